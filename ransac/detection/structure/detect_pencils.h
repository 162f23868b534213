// Pencils of parallel lines among detected lines, each with its direction and how well it is known.
#ifndef CIRCLINE_RANSAC_DETECTION_STRUCTURE_DETECT_PENCILS_H_
#define CIRCLINE_RANSAC_DETECTION_STRUCTURE_DETECT_PENCILS_H_

#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <vector>

#include "circline/estimators/observations.h"
#include "circline/ransac/detection/lines/detect_lines.h"
#include "circline/ransac/detection/lines/segment_meetings.h"

namespace circline {

struct DetectedPencil {
  PencilObservation observation;  // Lines, sigma_px and fit; no id, role or plane yet.
  std::vector<int> members;       // Its lines, indices into those searched, ascending.
  std::vector<Segment> ends;      // Of its lines, pixels.
  double support_px = 0.0;        // Length of its lines.

  bool Has(int line) const { return std::binary_search(members.begin(), members.end(), line); }
};

// Robust and sequential, first among all lines (`max_pencils`, 0 or more), then, for the longest
// pencils, among the lines that meet theirs: the short edges of a box are few among those of a
// room. Lines may be in several of the latter. `diagonal_px`: of the photo, as in
// segment_meetings.h. For each pencil the scatter of its lines about their common direction is
// estimated and the direction is fitted by maximum likelihood with it: the lines of a printed board
// all count for what they were measured, those of an old street, each a third of a degree from
// parallel, count alike. The longest pencil (sum of its lines) comes first. 0.5 ms for 150 lines.
std::vector<DetectedPencil> DetectPencils(const std::vector<DetectedLine>& lines, int max_pencils,
                                          std::uint64_t seed,
                                          double diagonal_px = kUsualDiagonalPx);

// The first half of that: without those around the longest, which are looked for at right angles.
std::vector<DetectedPencil> DetectPencilsApart(const std::vector<DetectedLine>& lines,
                                               int max_pencils, std::uint64_t seed,
                                               double diagonal_px = kUsualDiagonalPx);

// Fits, as those of pencils, of the lines that come near those of some pencils and are of none of
// them, one of each edge, longest first.
std::vector<LineFit> EdgesAround(const std::vector<DetectedLine>& lines,
                                 const std::vector<DetectedPencil>& pencils,
                                 double diagonal_px = kUsualDiagonalPx);

// The pencil of lines[members] along `direction`, each as good as its `fits` says (one a member):
// the line's own with a covariance that counts whatever else the line may miss the direction by.
// No fit.
DetectedPencil MakePencil(const std::vector<DetectedLine>& lines, const std::vector<int>& members,
                          const std::vector<LineFit>& fits, const Eigen::Vector3d& direction);

// Gives that the direction by its lines alone, whatever else it was made by; none of one line.
void FitAlone(DetectedPencil* pencil);

// A line's fit if all of its points share an error, pixels: no number of them averages it out.
LineFit WithSharedError(const DetectedLine& line, double shared_px);

// Of each line the longer one whose other side it is, or -1. Both sides are measurements; but that
// they are parallel is no accident and says nothing of a pencil.
std::vector<int> FindTwins(const std::vector<DetectedLine>& lines,
                           double diagonal_px = kUsualDiagonalPx);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_STRUCTURE_DETECT_PENCILS_H_
