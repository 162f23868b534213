// The direction of one pencil and its lines' scatter about it. Internal: not installed.
#ifndef CIRCLINE_RANSAC_DETECTION_PENCIL_FITTER_H_
#define CIRCLINE_RANSAC_DETECTION_PENCIL_FITTER_H_

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "circline/ransac/detection/detect_pencils.h"
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

// Fits the direction of one pencil to what it can have of all lines.
class PencilFitter {
 public:
  PencilFitter(const LineSet& set, double max_spread_rad)
      : set_(set), max_spread_(max_spread_rad) {}

  // The search finds what roughly shares a direction. Here the scatter of the lines about it is
  // estimated and the direction fitted to those of `candidates` within it, each with its own
  // covariance and the common scatter: the lines of a printed board all count for what they were
  // measured, those of an old street, each a third of a degree from parallel, count alike. False
  // where nothing fits.
  bool Fit(const std::vector<int>& candidates, FoundPencil* pencil, double* spread) const;

  // Moves the direction to where the pencil's lines are densest, if most of them are exactly
  // parallel.
  void StartAtDensest(std::uint64_t seed, FoundPencil* pencil) const;

 private:
  const LineFit& Line(int i) const { return set_.fits[static_cast<std::size_t>(i)]; }
  double Variance(int i, const Eigen::Vector3d& direction, double spread) const;
  std::vector<int> Near(const std::vector<int>& candidates, const Eigen::Vector3d& direction,
                        double spread) const;
  double EstimateSpread(const std::vector<int>& members, const Eigen::Vector3d& direction) const;

  const LineSet& set_;
  double max_spread_;
};

// With the fit that was found, and its lines' scatter about it in their covariances.
DetectedPencil MakePencil(const FoundPencil& found, const LineSet& set, double spread);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_PENCIL_FITTER_H_
