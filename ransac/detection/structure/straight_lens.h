// What the lines of a photo say of its lens, where nothing is known of that. Internal: not
// installed.
//
// A lens bends what is straight, by as much as k1 over the square of the focal length says: that is
// found without knowing the focal length. So the lines that were found are compared over k1 by what
// their bows are then: of each whether it is straight, or bent in some other way, as a mixture, so
// that arcs and the edges of soft things cost their share and no more.
#ifndef CIRCLINE_RANSAC_DETECTION_STRUCTURE_STRAIGHT_LENS_H_
#define CIRCLINE_RANSAC_DETECTION_STRUCTURE_STRAIGHT_LENS_H_

#include "circline/estimators/camera.h"
#include "circline/estimators/noise_model.h"
#include "circline/ransac/detection/structure/observe_evidence.h"

namespace circline {

// The camera at another focal length, its logarithm over the one it has. A lens of which nothing is
// known bends what it bends on the photo, one that is known at the angles at which it bends.
void SetFocal(double log_focal, const CameraSigma& sigma, Camera* camera);

struct LikelyLens {
  double k1 = 0.0;    // Of the camera, at its focal length.
  double gain = 0.0;  // Logarithm of how much likelier it is than the one known beforehand.
};

// The likeliest k1, `stated_k1` the one known beforehand, to noise.camera.k1. `evidence` was found
// through `camera`, of the model kOpenCV. 1 ms for 200 lines.
LikelyLens LikeliestLens(const PhotoEvidence& evidence, const Camera& camera,
                         const NoiseModel& noise, double stated_k1);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_STRUCTURE_STRAIGHT_LENS_H_
