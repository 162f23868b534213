// Where refinements of one world plane may start. Internal: not installed.
#ifndef CIRCLINE_REFINE_POSE_SEEDS_H_
#define CIRCLINE_REFINE_POSE_SEEDS_H_

#include <memory>
#include <string>
#include <vector>

#include "circline/estimators/solver_registry.h"
#include "circline/refine/estimate_pose.h"
#include "circline/refine/joint_problem.h"

namespace circline {

// Poses that the closed forms propose for the same world plane, and those of its circles, the
// cheapest first. `reasons` receives why closed forms refused, and first what their poses
// contradict where all of them do.
std::vector<CameraPose> CollectSeeds(const Observations& observations,
                                     const std::vector<std::shared_ptr<const Solver>>& seeders,
                                     const EstimationOptions& options, const JointProblem& problem,
                                     std::vector<std::string>* reasons);

}  // namespace circline

#endif  // CIRCLINE_REFINE_POSE_SEEDS_H_
