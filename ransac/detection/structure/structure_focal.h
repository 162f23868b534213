// The focal length at which the structure of a photo is likeliest, where it is not known.
// Internal: not installed.
//
// At a wrong focal length the discs of one sheet lie in different planes and the walls of a house
// are oblique. Compared over the focal lengths that are possible beforehand: the odds that the
// longest pencils are at right angles in pairs, that the circles have one plane, and that other
// lines are at right angles to the only pencil, or along the third direction of two.
#ifndef CIRCLINE_RANSAC_DETECTION_STRUCTURE_STRUCTURE_FOCAL_H_
#define CIRCLINE_RANSAC_DETECTION_STRUCTURE_STRUCTURE_FOCAL_H_

#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/noise_model.h"
#include "circline/ransac/detection/structure/observe_evidence.h"

namespace circline {

// Steps of log focal length: a third of what a degree of a right angle is worth at 30 degrees of
// tilt.
constexpr double kFocalStep = 0.02;

struct LikelyFocal {
  double log_focal = 0.0;  // Logarithm over the focal length of the camera.
  double gain = 0.0;       // Logarithm of how much likelier it is than that one.
};

// The likeliest focal length. `evidence` was calibrated with that of `camera`; the prior is about
// one that is `prior_log_focal` off, and a k1 that the camera's is `found_k1` beyond. `pencils` are
// those of DetectPencilsApart. Where the photo has no structure it is the prior's, without a limit
// to the gain. 10 ms for 12 circles.
LikelyFocal LikeliestFocal(const PhotoEvidence& evidence,
                           const std::vector<DetectedPencil>& pencils, const Camera& camera,
                           const CameraSigma& sigma, double prior_log_focal,
                           double diagonal_px = kUsualDiagonalPx, double found_k1 = 0.0);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_STRUCTURE_STRUCTURE_FOCAL_H_
