// One ceres::Problem for a reading, solved from a start.
#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "circline/refine/joint_problem.h"
#include "circline/refine/nearby_solve.h"

namespace circline {
namespace {

// Ends where a step, taken or not, changes the cost by little, or where the steps that would follow
// do (near the minimum under a loss they shrink at a constant rate), however large the cost of all
// points is: of many features one or another creeps in the tails of its loss long after the pose
// stands; where more steps like it would not lead to what competes; and where features that
// contradict each other, so that many points lie in the tails of the loss, make the steps creep.
class Watch : public ceres::IterationCallback {
 public:
  Watch(const Rival& rival, double free_cost, int unknowns)
      : little_(kLittleCost * std::max(1.0, unknowns / kFew)),
        most_(rival.cost + rival.gap),
        contradicted_(free_cost + rival.contradiction),
        free_cost_(free_cost) {}
  bool creeps() const { return num_slow_ == kMostSlow; }
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    constexpr double kMoreSteps = 5.0;
    if (summary.iteration == 0 || !summary.step_is_valid) return ceres::SOLVER_CONTINUE;
    const double rate = last_change_ > 0.0 ? summary.cost_change / last_change_ : 1.0;
    last_change_ = summary.step_is_successful ? summary.cost_change : 0.0;
    const bool converges = rate > 0.0 && rate < 1.0;
    const double rest = converges ? summary.cost_change * rate / (1.0 - rate) : summary.cost_change;
    if (std::min(std::abs(summary.cost_change), std::abs(rest)) < little_)
      return ceres::SOLVER_TERMINATE_SUCCESSFULLY;
    constexpr double kSlow = 0.003;  // Of what is above the free fits.
    const bool is_slow = summary.cost > contradicted_ && summary.step_is_successful &&
                         summary.cost_change < kSlow * (summary.cost - free_cost_);
    num_slow_ = is_slow ? num_slow_ + 1 : 0;
    if (creeps()) return ceres::SOLVER_TERMINATE_SUCCESSFULLY;
    const bool is_hopeless =
        summary.step_is_successful && summary.cost - kMoreSteps * summary.cost_change > most_;
    return is_hopeless ? ceres::SOLVER_ABORT : ceres::SOLVER_CONTINUE;
  }

 private:
  static constexpr int kMostSlow = 2;   // Steps, one after the other.
  static constexpr double kFew = 20.0;  // Unknowns: a pose's and a camera's, not tuned.
  double little_, most_, contradicted_, free_cost_;
  double last_change_ = 0.0;
  int num_slow_ = 0;
};

}  // namespace

Status JointProblem::Solve(int max_iterations, State* state, const Rival& rival) const {
  // Ceres prints what it cannot evaluate. Where the cost was finite before, it is.
  const bool is_finite = std::all_of(state->x.begin(), state->x.end(),
                                     [](double value) { return std::isfinite(value); });
  if (!is_finite || (!std::isfinite(state->cost) && !std::isfinite(Cost(*state))))
    return Status::Failed("the evidence cannot be evaluated at the seed");
  ceres::Problem problem(OwnsNothing());
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
    problem.AddResidualBlock(term.cost.get(), term.loss.get(), blocks);
  }
  if (unknowns == 0) return Status::Refused("nothing of the evidence ties the pose");

  ceres::Solver::Options options = NearbyOptions(unknowns, max_iterations, state->cost);
  if (options.linear_solver_type == ceres::SPARSE_NORMAL_CHOLESKY) {
    // A feature's own unknowns, the largest block of each, are eliminated first.
    auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    std::vector<const Block*> largest(static_cast<std::size_t>(num_groups_), nullptr);
    const auto is_unknown = [&](const Block& block) {
      return added[static_cast<std::size_t>(&block - blocks_.data())] != 0 &&
             block.tangent_size() > 0;
    };
    for (const Block& block : blocks_) {
      if (block.group < 0 || !is_unknown(block)) continue;
      const Block*& own = largest[static_cast<std::size_t>(block.group)];
      if (own == nullptr || block.tangent_size() > own->tangent_size()) own = &block;
    }
    int left = unknowns;
    for (const Block& block : blocks_) {
      if (!is_unknown(block)) continue;
      const bool is_eliminated =
          block.group >= 0 && largest[static_cast<std::size_t>(block.group)] == &block;
      if (is_eliminated) left -= block.tangent_size();
      ordering->AddElementToGroup(state->x.data() + block.offset, is_eliminated ? 0 : 1);
    }
    // What is left is a small matrix, or a large one of many zeros (the benchmark CirclesOfAPlane
    // tells from where on; not tuned).
    constexpr int kSparse = 200;
    options.linear_solver_type = left > kSparse ? ceres::SPARSE_SCHUR : ceres::DENSE_SCHUR;
    options.linear_solver_ordering = ordering;
  }
  Watch watch(rival, FreeCost(*state), unknowns);
  options.callbacks.push_back(&watch);
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (summary.termination_type == ceres::USER_FAILURE)
    return Status::Refused("another pose explains the evidence far better");
  if (!summary.IsSolutionUsable() && summary.termination_type != ceres::NO_CONVERGENCE)
    return Status::Failed("the evidence cannot be evaluated at the seed");
  state->cost = summary.final_cost;
  state->is_rough = watch.creeps();
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

// Of all features, root mean square over its points, standard deviations.
double JointProblem::LargestMiss(const State& state) const {
  constexpr double kNoLoss = 1e4;  // So wide a loss is none.
  Weighing weighing;
  weighing.stretch = kNoLoss;
  double most = 0.0;
  for (const Term& term : terms_) {
    if (term.weighed == nullptr || !IsActive(term, state)) continue;
    const ImagePoints* points = term.weighed->points();
    const double num_points =
        points != nullptr ? points->options().weight * static_cast<double>(points->size()) : 1.0;
    most = std::max(most, TwiceCost(term, state, weighing) / std::max(1.0, num_points));
  }
  return std::sqrt(most);
}

Status JointProblem::SolveGraduated(int max_iterations, State* state, const Rival& rival) const {
  if (options_.conic_loss.type == LossType::kTrivial &&
      options_.line_loss.type == LossType::kTrivial) {
    return Solve(max_iterations, state, rival);
  }
  Weighing weighing;
  constexpr double kWidest = 300.0, kNarrower = 0.25;
  const auto is_bounded = [](LossType loss) {
    return loss == LossType::kTukey || loss == LossType::kGemanMcClure || loss == LossType::kArctan;
  };
  // A loss that is bounded soon has no slope to follow.
  const double near =
      is_bounded(options_.conic_loss.type) || is_bounded(options_.line_loss.type) ? 1.5 : 3.0;
  constexpr int kIterations = 2;  // Of each width: near enough for the next.
  for (double width = std::min(LargestMiss(*state), kWidest); width > near; width *= kNarrower) {
    weighing.stretch = width;
    SetWeighing(weighing);
    const Status status = Solve(kIterations, state);
    SetWeighing(Weighing());
    if (!status.ok()) return status;
  }
  return Solve(max_iterations, state, rival);
}

}  // namespace circline
