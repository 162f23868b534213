// The direction of one pencil and its lines' scatter about it. Internal: not installed.
#ifndef CIRCLINE_RANSAC_DETECTION_STRUCTURE_PENCIL_FITTER_H_
#define CIRCLINE_RANSAC_DETECTION_STRUCTURE_PENCIL_FITTER_H_

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "circline/ransac/detection/structure/detect_pencils.h"
#include "circline/ransac/robust_pencils.h"

namespace circline {

// Detected lines with what the search for pencils knows of them.
struct LineSet {
  LineSet(const std::vector<DetectedLine>& detected, double photo_px);
  bool IsTwin(int i) const { return twin_of[static_cast<std::size_t>(i)] >= 0; }
  // Twins count once.
  int Count(const std::vector<int>& members) const;

  const std::vector<DetectedLine>& lines;
  double diagonal_px;         // Of the photo.
  std::vector<LineFit> fits;  // With the shared error.
  std::vector<int> twin_of;
};

// The search finds what roughly shares a direction. Here the scatter of the lines about it is
// estimated, up to `max_spread_rad`, and the direction fitted to those of `candidates` within it,
// each with its own covariance and the common scatter: the lines of a printed board all count for
// what they were measured, those of an old street, each a third of a degree from parallel, count
// alike. None where nothing fits, or fewer lines than `min_lines`, twins counted once.
std::optional<DetectedPencil> FitPencil(const LineSet& set, const std::vector<int>& candidates,
                                        const Eigen::Vector3d& direction, double max_spread_rad,
                                        int min_lines);

// Fits the pencil again, to all of `candidates` that share its direction within up to half a degree
// (standard deviation, estimated): for lines that are known to be of one thing, whose sides may
// bend or be badly printed. False, and nothing changed, where none do.
bool RefitPencil(const LineSet& set, const std::vector<int>& candidates, DetectedPencil* pencil);

// The direction that most of the lines have if they are exactly parallel; `direction` where there
// is none.
Eigen::Vector3d DensestDirection(const LineSet& set, const std::vector<int>& lines,
                                 const Eigen::Vector3d& direction, std::uint64_t seed);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_STRUCTURE_PENCIL_FITTER_H_
