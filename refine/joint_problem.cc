#include "circline/refine/joint_problem.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "circline/refine/graduated.h"
#include "circline/refine/joint_start.h"
#include "circline/refine/minimize.h"
#include "circline/refine/noise_scales.h"

namespace circline {
namespace {

// What the circles and lengths left out cost: as much as points far off, so that no pose gains by
// explaining less.
double LeftOutCost(const JointEvidence& e, const JointState& state) {
  constexpr double kFarOffSigmas = 30.0;
  double cost = 0.0;
  for (std::size_t i = 0; i < e.circles.size(); ++i) {
    if (state.circle_left_out[i] == 0) continue;
    const PointSet& set = e.sets[static_cast<std::size_t>(e.circles[i].set)];
    cost += 0.5 * static_cast<double>(set.points.size()) *
            EvaluateLoss(set.loss, kFarOffSigmas * kFarOffSigmas).rho;
  }
  const auto lengths = std::count(state.length_left_out.begin(), state.length_left_out.end(), 1);
  const double of_one_end =
      0.5 * EvaluateLoss(e.options.line_loss.type, kFarOffSigmas * kFarOffSigmas).rho;
  return cost + static_cast<double>(lengths) * of_one_end;
}

// A smooth error that a feature's points share (SetScales) makes them count less, yet it explains
// no point that is many of its standard deviations off: those count in full where poses are
// compared.
double FarOffCost(const JointEvidence& e, const JointState& state) {
  constexpr double kFarSigmas = 5.0;
  double cost = 0.0;
  ForEachCurve(
      e, state,
      [&](const PointSet& set, bool is_circle, std::size_t, const std::vector<double>& distances) {
        if (!(set.weight < 1.0)) return;
        const double bias = is_circle ? e.options.contour_bias_px : e.options.line_bias_px;
        const double far = kFarSigmas * std::hypot(set.sigma_px, bias);
        for (const double d : distances) {
          if (!(std::abs(d) > far)) continue;
          const double sigmas = d / set.sigma_px;
          cost += 0.5 * (1.0 - set.weight) * EvaluateLoss(set.loss, sigmas * sigmas).rho;
        }
      });
  return cost;
}

}  // namespace

const JointEvidence& JointProblem::At(const Approach& approach,
                                      std::optional<RefocusedEvidence>* refocused) const {
  if (approach.log_focal == 0.0) return evidence_;
  return refocused->emplace(evidence_, approach.log_focal).evidence();
}

double JointProblem::Cost(const JointEvidence& e, const Approach& approach) const {
  return JointCost(e, approach.state, SetWeighing()) + LeftOutCost(e, approach.state) +
         FarOffCost(e, approach.state) + FocalPriorCost(evidence_, approach.log_focal);
}

bool JointProblem::is_contaminated() const {
  return std::any_of(evidence_.sets.begin(), evidence_.sets.end(),
                     [](const PointSet& set) { return set.is_contaminated; });
}

Status JointProblem::SeedCost(const CameraPose& seed, double* cost) const {
  JointState state;
  const Status status = InitializeState(evidence_, seed, &state);
  if (!status.ok()) return status;
  *cost = JointCost(evidence_, state, SetWeighing()) + LeftOutCost(evidence_, state);
  return std::isfinite(*cost) ? Status::Ok()
                              : Status::Failed("the evidence cannot be evaluated at the seed");
}

Status JointProblem::ApproachFrom(const CameraPose& seed, Approach* approach) const {
  approach->pose = seed;
  const Status status = InitializeState(evidence_, seed, &approach->state);
  return status.ok() ? Continue(approach) : status;
}

Status JointProblem::Continue(Approach* approach) const {
  constexpr int kFirstIterations = 3;
  constexpr double kTolerance = 0.01;  // Of cost: a seventh of a standard deviation.
  const EstimationOptions& options = evidence_.options;
  const int iterations = std::min(kFirstIterations, options.max_iterations);
  JointState* state = &approach->state;
  const Status status = options.focal_sigma > 0.0
                            ? MinimizeWithFocal(evidence_, kTolerance, state, &approach->log_focal)
                            : GraduatedMinimize(evidence_, iterations, kTolerance, state);
  if (!status.ok()) return status;
  std::optional<RefocusedEvidence> refocused;
  const JointEvidence& e = At(*approach, &refocused);
  approach->cost = Cost(e, *approach);
  approach->scales = ScatterAboutPose(e, *state);
  approach->pose = PoseAt(e, *state, approach->pose);
  const bool is_finite = std::isfinite(approach->cost) && approach->pose.rotation.allFinite() &&
                         approach->pose.translation.allFinite();
  return is_finite ? Status::Ok() : Status::Failed("the refinement left the range of numbers");
}

double JointProblem::InlierShare(const Approach& approach) const {
  std::size_t inliers = 0, points = 0;
  std::optional<RefocusedEvidence> refocused;
  const JointEvidence& e = At(approach, &refocused);
  for (const PointSet& set : e.sets) points += set.num_trusted;
  ForEachCurve(e, approach.state,
               [&](const PointSet& set, bool, std::size_t, const std::vector<double>& distances) {
                 for (std::size_t i = 0; i < set.num_trusted; ++i)
                   inliers += std::abs(distances[i]) <= kInlierSigmas * set.sigma_px ? 1 : 0;
               });
  return points > 0 ? static_cast<double>(inliers) / static_cast<double>(points) : 0.0;
}

Status JointProblem::Refine(const Approach& start, Refined* refined) const {
  constexpr double kTolerance = 1e-7;  // Of cost: a two-thousandth of a standard deviation.
  const EstimationOptions& options = evidence_.options;
  *refined = Refined();
  Approach approach = start;
  JointState& state = approach.state;
  const Status status = options.focal_sigma > 0.0
                            ? MinimizeWithFocal(evidence_, kTolerance, &state, &approach.log_focal)
                            : Minimize(evidence_, 1.0, options.max_iterations, kTolerance, &state);
  if (!status.ok()) return status;
  std::optional<RefocusedEvidence> refocused;
  const JointEvidence& e = At(approach, &refocused);
  refined->hypothesis.cost = Cost(e, approach);
  return FillRefined(evidence_, approach.log_focal, e, approach.pose, std::move(state), refined);
}

}  // namespace circline
