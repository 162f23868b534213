// Which of the detected circles and pencils share a plane, and what the pencils are in its frame.
#ifndef CIRCLINE_RANSAC_DETECTION_ASSEMBLE_OBSERVATIONS_H_
#define CIRCLINE_RANSAC_DETECTION_ASSEMBLE_OBSERVATIONS_H_

#include <array>
#include <vector>

#include "circline/estimators/observations.h"
#include "circline/ransac/detection/detect_pencils.h"
#include "circline/ransac/detection/uncertain_direction.h"

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

// Chooses the plane with most support, "p0": that of two pencils and the circles that agree with
// it, or of circles alone. Agreement is a test with the propagated covariances. Two pencils in it
// that are likelier at right angles than at any become x and y, a third orthogonal to both z;
// others stay free. Appends circles ("c0", ...) and pencils ("L0", ...) to `observations`, those of
// the plane first. `circles` and `pencils` are ordered by support; they are moved from. `lines` are
// those that the pencils' members index; the two pencils that span the plane are fitted again to
// all that lie where the two meet. Where circles are all that a plane has, a box that stands on it
// (of `lines` and `bent` ones) gives it x and y, and tells which of a lone circle's two normals it
// has. A box with an axis along a pencil is taken where there is no plane, and instead of two
// pencils one of which is along none of its axes and has less evidence than they. Where there is no
// plane, or that of one circle which can lie in it, the sides of a rectangle are x and y.
void AssembleObservations(const AssemblyOptions& options, const std::vector<DetectedLine>& lines,
                          const std::vector<DetectedLine>& bent,
                          std::vector<CircleEvidence>* circles,
                          std::vector<DetectedPencil>* pencils, Observations* observations);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_ASSEMBLE_OBSERVATIONS_H_
