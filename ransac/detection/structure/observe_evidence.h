// From evidence to Observations: what DetectObservations does once it has looked at the photo.
// Segments that come from elsewhere, without a photo, go in here. Internal: not
// installed, but exported, for circline_simulate.
#ifndef CIRCLINE_RANSAC_DETECTION_STRUCTURE_OBSERVE_EVIDENCE_H_
#define CIRCLINE_RANSAC_DETECTION_STRUCTURE_OBSERVE_EVIDENCE_H_

#include <cstddef>
#include <vector>

#include "circline/estimators/export.h"
#include "circline/ransac/detection/detect_observations.h"
#include "circline/ransac/detection/lines/detect_lines.h"
#include "circline/ransac/detection/structure/assemble_observations.h"

namespace CIRCLINE_EXPORT circline {

struct PhotoEvidence {
  std::vector<CircleEvidence> circles;  // Best first.
  std::size_t num_ellipses = 0;         // Found, before the best of them were kept.
  std::vector<DetectedLine> lines;      // Longest first.
  std::vector<DetectedLine> bent;       // See DetectLines.
};

// Of a photo that what meets is measured in. Edges are smoothed and end some pixels before corners:
// in photos smaller than usual distances shrink no further.
double DiagonalPx(int width, int height);

// Pencils, the plane, the roles: fills all of `observations` but its camera, which is there.
// `evidence` is moved from.
void ObserveEvidence(const DetectionOptions& options, double diagonal_px, PhotoEvidence* evidence,
                     Observations* observations);

// A line from a segment's end points, each with the standard deviation `sigma_px` across it. Not ok
// where the camera cannot undistort them or they coincide.
Status LineFromSegment(const Camera& camera, const Segment& segment, double sigma_px,
                       DetectedLine* line);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_STRUCTURE_OBSERVE_EVIDENCE_H_
