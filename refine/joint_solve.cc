// One ceres::Problem for a reading, solved from a start.
#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "circline/refine/joint_problem.h"

namespace circline {

void JointProblem::SetReading(const State& state) const {
  for (const PencilBlocks& p : pencils_) {
    for (std::size_t i = 0; i < p.features.size(); ++i) {
      p.cost->SetActive(i, state.active[static_cast<std::size_t>(p.features[i])] != 0);
    }
  }
}

Status JointProblem::Solve(int max_iterations, State* state, bool* converged) const {
  SetReading(*state);
  ceres::Problem::Options ownership;
  ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.disable_all_safety_checks = true;
  ceres::Problem problem(ownership);
  std::vector<double*> blocks;
  std::vector<std::uint8_t> added(blocks_.size(), 0);
  int unknowns = 0;
  for (const Term& term : terms_) {
    if (!IsActive(term, *state)) continue;
    blocks.clear();
    for (const int index : term.blocks) {
      const auto i = static_cast<std::size_t>(index);
      const Block& block = blocks_[i];
      double* values = state->x.data() + block.offset;
      blocks.push_back(values);
      if (added[i] != 0) continue;
      added[i] = 1;
      unknowns += block.tangent_size();
      problem.AddParameterBlock(values, block.size,
                                const_cast<ceres::Manifold*>(block.manifold));  // Not owned.
      if (block.is_constant) problem.SetParameterBlockConstant(values);
    }
    problem.AddResidualBlock(term.cost.get(), nullptr, blocks);
  }
  if (unknowns == 0) return Status::Refused("nothing of the evidence ties the pose");

  ceres::Solver::Options options;
  // Beyond so many unknowns most of them are features' own, and the normal equations are sparse.
  constexpr int kDense = 60;
  options.linear_solver_type =
      unknowns <= kDense ? ceres::DENSE_NORMAL_CHOLESKY : ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = max_iterations;
  // Of cost: small against a standard deviation whatever the number of points.
  options.function_tolerance = 1e-9;
  options.gradient_tolerance = 1e-9;
  options.parameter_tolerance = 1e-10;
  options.initial_trust_region_radius = 1e6;  // Starts are near, and the model is good.
  options.max_consecutive_nonmonotonic_steps = 0;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;  // Same bits out.
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable() && summary.termination_type != ceres::NO_CONVERGENCE)
    return Status::Failed("the evidence cannot be evaluated at the seed");
  state->cost = summary.final_cost;
  if (converged != nullptr) *converged = summary.termination_type == ceres::CONVERGENCE;
  for (const double v : state->x) {
    if (!std::isfinite(v)) return Status::Failed("the refinement left the range of numbers");
  }
  return std::isfinite(state->cost) ? Status::Ok()
                                    : Status::Failed("the refinement left the range of numbers");
}

void JointProblem::SetWeighing(const Weighing& weighing) const {
  for (const Term& term : terms_) {
    if (term.weighed != nullptr) term.weighed->set_weighing(weighing);
  }
}

Status JointProblem::SolveGraduated(int max_iterations, State* state) const {
  constexpr double kWidest = 300.0, kNarrower = 1.0 / 3.0;
  constexpr int kIterations = 3;  // Of each width: near enough for the next.
  // Wide losses would cost so much more: much lies in the tails.
  constexpr double kFar = 2.0;
  Weighing weighing;
  const auto is_far = [&](double width) {
    Weighing wide;
    wide.stretch = width;
    return Cost(*state, wide) > kFar * Cost(*state);
  };
  constexpr double kTails = 10.0;
  double width = is_far(kTails) ? kWidest : 1.0;
  for (; width * kNarrower >= 1.0; width *= kNarrower) {
    weighing.stretch = width;
    SetWeighing(weighing);
    const Status status = Solve(kIterations, state);
    SetWeighing(Weighing());
    if (!status.ok()) return status;
    if (!is_far(kTails)) break;
  }
  return Solve(max_iterations, state);
}

}  // namespace circline
