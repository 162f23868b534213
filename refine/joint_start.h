// Where a refinement starts: every unknown at a seed pose. Internal: not installed.
#ifndef CIRCLINE_REFINE_JOINT_START_H_
#define CIRCLINE_REFINE_JOINT_START_H_

#include <Eigen/Core>

#include "circline/estimators/pose.h"
#include "circline/estimators/status.h"
#include "circline/refine/joint_evidence.h"
#include "circline/refine/reduced_problem.h"

namespace circline {

// Values of all unknowns at a seed (its rotation and, where the origin is known, its translation):
// closed forms from each feature's fit; where many of a feature's points are doubted, so that the
// fit may have followed outliers, the best of a few dozen trials under the robust loss. Refused
// where the seed contradicts the evidence. An ellipse that the plane cannot explain (across or
// beyond the horizon) is left out, and so is a length of which one end lies beyond; the seed is
// refused only where that leaves no circle.
Status InitializeState(const JointEvidence& evidence, const CameraPose& seed, JointState* state);

// Plane coordinates (X, Y) at which a ray meets the plane; false where it does not, in front.
bool PlanePoint(const Eigen::Matrix3d& R, double facing, const Eigen::Vector3d& ray, double* xy);

}  // namespace circline

#endif  // CIRCLINE_REFINE_JOINT_START_H_
