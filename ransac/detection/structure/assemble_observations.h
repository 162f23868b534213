// Which of the detected circles and pencils share a plane, and what the pencils are in its frame.
#ifndef CIRCLINE_RANSAC_DETECTION_STRUCTURE_ASSEMBLE_OBSERVATIONS_H_
#define CIRCLINE_RANSAC_DETECTION_STRUCTURE_ASSEMBLE_OBSERVATIONS_H_

#include <array>
#include <vector>

#include "circline/estimators/observations.h"
#include "circline/ransac/detection/structure/detect_pencils.h"
#include "circline/ransac/detection/structure/uncertain_direction.h"

namespace circline {

struct CircleEvidence {
  CircleObservation observation;              // Points, sigma_px, fit; no id or plane yet.
  std::array<UncertainDirection, 2> normals;  // That its plane can have; see CircleNormals.
  int num_normals = 0;
  double support_px = 0.0;  // Length of rim that edges support.
};

struct AssemblyOptions {
  int max_pencils = 3;                    // That are kept, those with a role first.
  double max_shared_plane_deg = 5.0;      // As in DetectionOptions.
  double diagonal_px = kUsualDiagonalPx;  // Of the photo (segment_meetings.h).
  CameraError camera;  // Of one whose focal length was looked for; else none counts.
  // Of such a one: what is known beforehand of the logarithm of the focal length, over the
  // camera's.
  double prior_log_focal = 0.0, focal_sigma = 0.0;
};

// What DetectObservations says of planes, axes and ids. Appends circles ("c0", ...) and pencils
// ("L0", ...) to `observations`, those of the plane "p0" first. `circles` and `pencils` are ordered
// by support; they are moved from. `lines` are those that the pencils' members index. A box, of
// `lines` and `bent` ones, is also taken instead of two pencils one of which is along none of its
// axes and has less evidence than they; beside a lone circle it is not taken, nor is that circle's
// plane, where two pencils have more evidence than any box.
void AssembleObservations(const AssemblyOptions& options, const std::vector<DetectedLine>& lines,
                          const std::vector<DetectedLine>& bent,
                          std::vector<CircleEvidence>* circles,
                          std::vector<DetectedPencil>* pencils, Observations* observations);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_STRUCTURE_ASSEMBLE_OBSERVATIONS_H_
