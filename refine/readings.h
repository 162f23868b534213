// From seeds to ranked hypotheses: every reading of the evidence (which features take part) that
// competes, refined from every start. What EstimatePose and the refined solvers share. Internal:
// not installed.
#ifndef CIRCLINE_REFINE_READINGS_H_
#define CIRCLINE_REFINE_READINGS_H_

#include <memory>
#include <string>
#include <vector>

#include "circline/estimators/solver_registry.h"
#include "circline/refine/estimate_pose.h"

namespace circline {

// Runs the seeders, refines what they propose for the world frame of `observations` on all of
// `observations`, and names the estimate `name`.
PoseEstimate RefineSeeds(const std::string& name,
                         const std::vector<std::shared_ptr<const Solver>>& seeders,
                         const Observations& observations, const EstimationOptions& options);

}  // namespace circline

#endif  // CIRCLINE_REFINE_READINGS_H_
