// One ceres::Problem for a reading, solved from a start.
#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <optional>
#include <vector>

#include "circline/refine/block_chain.h"
#include "circline/refine/joint/joint_problem.h"
#include "circline/refine/joint/seen_points.h"
#include "circline/refine/nearby_solve.h"

namespace circline {
namespace {

// Losses that start wide and narrow to their own width after every few steps (graduated
// non-convexity; Black and Rangarajan 1996), all within one call of ceres: it asks for the cost and
// the derivatives where a step has led, and gets them under the next width; and points that are
// undistorted once for both.
class Narrowing : public ceres::EvaluationCallback {
 public:
  // `widths`: tuning constants, in those of the losses, one after the other, for `steps` each.
  Narrowing(const JointProblem& problem, const State& state, const std::vector<double>& widths,
            int steps)
      : problem_(problem), state_(state), widths_(widths), steps_each_(steps) {
    Apply();
  }
  ~Narrowing() override { problem_.SetWeighing(Weighing()); }
  Narrowing(const Narrowing&) = delete;
  Narrowing& operator=(const Narrowing&) = delete;

  bool is_wide() const { return next_ < widths_.size(); }
  void Narrow() {
    ++next_;
    steps_ = 0;
    Apply();
  }
  void PrepareForEvaluation(bool jacobians, bool is_new_point) override {
    if (is_new_point) problem_.SeeThrough(state_);
    const bool has_stepped = jacobians && !is_new_point;
    if (is_wide() && has_stepped && ++steps_ == steps_each_) Narrow();
  }
  // Of all widths together.
  int num_steps() const { return steps_each_ * static_cast<int>(widths_.size()); }

 private:
  void Apply() {
    Weighing weighing;
    if (is_wide()) weighing.stretch = widths_[next_];
    problem_.SetWeighing(weighing);
  }

  const JointProblem& problem_;
  const State& state_;  // Where ceres stands.
  const std::vector<double>& widths_;
  int steps_each_;
  std::size_t next_ = 0;
  int steps_ = 0;
};

// Ends where a step, taken or not, changes the cost by little, or where the steps that would follow
// do (near the minimum under a loss they shrink at a constant rate), however large the cost of all
// points is: of many features one or another creeps in the tails of its loss long after the pose
// stands; and where more steps like it would not lead to what competes.
class Watch : public ceres::IterationCallback {
 public:
  Watch(double most_cost, int unknowns, const Narrowing& losses)
      : losses_(losses),
        was_wide_(losses.is_wide()),
        little_(kLittleCost * std::max(1.0, unknowns / kFew)),
        most_(most_cost) {}
  // The first step after the losses have narrowed led upwards: ceres compared its cost with that of
  // the wider ones.
  bool has_risen() const { return has_risen_; }
  ceres::CallbackReturnType operator()(const ceres::IterationSummary& summary) override {
    if (was_wide_) {
      was_wide_ = losses_.is_wide();
      narrowed_cost_ = summary.cost;
      return ceres::SOLVER_CONTINUE;
    }
    if (summary.iteration == 0 || !summary.step_is_valid) return ceres::SOLVER_CONTINUE;
    has_risen_ = summary.step_is_successful && summary.cost > narrowed_cost_;
    if (has_risen_) return ceres::SOLVER_TERMINATE_SUCCESSFULLY;
    const double rate = last_change_ > 0.0 ? summary.cost_change / last_change_ : 1.0;
    last_change_ = summary.step_is_successful ? summary.cost_change : 0.0;
    // What the evidence tells little of goes but a part of its way in a smaller trust region.
    constexpr double kWholeSteps = 1e5;
    const bool is_part = summary.step_is_successful && summary.trust_region_radius < kWholeSteps;
    const bool converges = rate > 0.0 && rate < 1.0;
    const double rest = converges ? summary.cost_change * rate / (1.0 - rate) : summary.cost_change;
    if (!is_part && std::min(std::abs(summary.cost_change), std::abs(rest)) < little_)
      return ceres::SOLVER_TERMINATE_SUCCESSFULLY;
    constexpr double kMoreSteps = 5.0;
    const bool is_hopeless =
        summary.step_is_successful && summary.cost - kMoreSteps * summary.cost_change > most_;
    return is_hopeless ? ceres::SOLVER_ABORT : ceres::SOLVER_CONTINUE;
  }

 private:
  static constexpr double kFew = 20.0;  // Unknowns: a pose's and a camera's, not tuned.
  const Narrowing& losses_;
  bool was_wide_, has_risen_ = false;
  double narrowed_cost_ = std::numeric_limits<double>::infinity();
  double little_, most_, last_change_ = 0.0;
};

bool HasBoundedLoss(const EstimationOptions& options) {
  const auto is_bounded = [](LossType loss) {
    return loss == LossType::kTukey || loss == LossType::kGemanMcClure || loss == LossType::kArctan;
  };
  return is_bounded(options.conic_loss.type) || is_bounded(options.line_loss.type);
}

}  // namespace

Status JointProblem::Solve(int max_iterations, State* state, double most_cost,
                           const std::vector<double>& widths) const {
  const auto is_finite = [state] {
    return Eigen::Map<const Eigen::VectorXd>(state->x.data(),
                                             static_cast<Eigen::Index>(state->x.size()))
        .allFinite();
  };
  // Ceres prints what it cannot evaluate. Where the cost was finite before, it is.
  if (!is_finite() || (!std::isfinite(state->cost) && !std::isfinite(Cost(*state))))
    return Status::Failed("the evidence cannot be evaluated at the seed");
  // A wide loss is nearly that of least squares, of which one step comes near enough for the next
  // width; not one that is bounded, and soon flat.
  Narrowing losses(*this, *state, widths, HasBoundedLoss(options_) ? 2 : 1);
  ceres::Problem::Options of_problem = OwnsNothing();
  if (losses.is_wide() || camera_is_estimated_) of_problem.evaluation_callback = &losses;
  std::optional<SeenPoints> seen;
  if (camera_is_estimated_) seen.emplace(*this, state);
  ceres::Problem problem(of_problem);
  const int unknowns =
      seen ? seen->Fill(&problem) : Fill(ActiveTerms(*state), state->x.data(), &problem);
  if (unknowns == 0) return Status::Refused("nothing of the evidence ties the pose");

  // Ceres asks for a share of the cost, of which the free fits' is the most that is known; it falls
  // no further than that, and where it stays above ten times as much a little is still little.
  const double least_cost = std::max(FreeCost(*state), kNothing / kLittleCost * state->cost);
  ceres::Solver::Options options =
      NearbyOptions(unknowns, max_iterations + losses.num_steps(), least_cost);
  // A start that is far: what the model says of a whole step does not hold.
  if (state->cost > most_cost) options.initial_trust_region_radius = 1e3;
  ceres::Solver::Summary summary;
  for (bool is_done = false; !is_done;) {
    Watch watch(most_cost, unknowns, losses);
    options.callbacks = {&watch};
    ceres::Solve(options, &problem, &summary);
    is_done = !summary.IsSolutionUsable() || (!losses.is_wide() && !watch.has_risen());
    if (losses.is_wide()) losses.Narrow();  // A minimum of the wider ones.
  }
  seen.reset();
  if (summary.termination_type == ceres::USER_FAILURE)
    return Status::Refused("another pose explains the evidence far better");
  if (!summary.IsSolutionUsable() && summary.termination_type != ceres::NO_CONVERGENCE)
    return Status::Failed("the evidence cannot be evaluated at the seed");
  state->cost = summary.final_cost;
  return std::isfinite(state->cost) && is_finite()
             ? Status::Ok()
             : Status::Failed("the refinement left the range of numbers");
}

Status JointProblem::SolveGraduated(int max_iterations, State* state) const {
  constexpr double kWidest = 300.0, kNarrower = 0.25,
                   kAny = std::numeric_limits<double>::infinity();
  const bool are_losses = options_.conic_loss.type != LossType::kTrivial ||
                          options_.line_loss.type != LossType::kTrivial;
  // A loss that is bounded soon has no slope to follow.
  const double near = HasBoundedLoss(options_) ? 1.5 : 3.0;
  double width = are_losses ? LargestRms(ActiveTerms(*state), state->x.data()) : 0.0;
  std::vector<double> widths;
  for (width = std::min(width, kWidest); width > near; width *= kNarrower) widths.push_back(width);
  return Solve(max_iterations, state, kAny, widths);
}

}  // namespace circline
