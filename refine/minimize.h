// The least-squares solver of the joint problem. Internal: not installed.
#ifndef CIRCLINE_REFINE_MINIMIZE_H_
#define CIRCLINE_REFINE_MINIMIZE_H_

#include "circline/estimators/status.h"
#include "circline/refine/joint_evidence.h"
#include "circline/refine/reduced_problem.h"

namespace circline {

// Lowers the cost of `state` under the stretched loss, by Levenberg and Marquardt's method
// (ceres::TinySolver) on the shared unknowns. Stops when a step gains less than `tolerance` in
// cost. Not ok where the evidence cannot be evaluated.
Status Minimize(const JointEvidence& evidence, double stretch, int max_iterations, double tolerance,
                JointState* state);

}  // namespace circline

#endif  // CIRCLINE_REFINE_MINIMIZE_H_
