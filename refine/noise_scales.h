// How noisy the points are of features that do not say so: "auto". Internal: not installed.
#ifndef CIRCLINE_REFINE_NOISE_SCALES_H_
#define CIRCLINE_REFINE_NOISE_SCALES_H_

#include "circline/estimators/observations.h"
#include "circline/refine/estimate_pose.h"
#include "circline/refine/joint_evidence.h"
#include "circline/refine/reduced_problem.h"

namespace circline {

// Of drawn axes and lines whose noise can neither be known nor measured.
constexpr double kDefaultLineSigmaPx = 0.4;

// Scatter of the points about their own fits, 1.4826 x the median absolute residual; 0 where
// nothing is redundant.
NoiseScales ScatterAboutFits(const Observations& fitted);

// Scatter about the common pose of those points whose noise is automatic, degrees of freedom
// counted in; 0 where too few are redundant to tell.
NoiseScales ScatterAboutPose(const JointEvidence& evidence, const JointState& state);

// What could not be measured is a third of a pixel or so.
NoiseScales OrDefault(const NoiseScales& scales);

// Features that fit well one by one may fit badly together (a plane not quite flat): then the
// scatter about the common pose is the noise that counts. True if that raised an automatic scale.
bool RaiseScales(const NoiseScales& about_pose, NoiseScales* scales);

// For the closed forms: gives every feature that states no sigma_px the one that options or
// measurement say, its shared error included (EstimationOptions::contour_bias_px).
Observations ApplyScales(const Observations& observations, const EstimationOptions& options,
                         const NoiseScales& scales);

}  // namespace circline

#endif  // CIRCLINE_REFINE_NOISE_SCALES_H_
