// What it costs to leave a feature out, and what comes back.
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/circle_planes.h"
#include "circline/refine/joint/joint_result.h"

namespace circline {
namespace {

// -log of the probability that so many of a photo's features, and these, are none of what they are
// said to be, over that of none. Photos differ: their share of clutter has a beta prior, so that
// where one line is odd another is less of a surprise.
double ClutterShareCost(int num_clutter, int num_features) {
  constexpr double kShare = 0.02;
  // Of the prior, features. Of 2, 10 and 50, on two odd lines of five (circline_scenes_benchmark,
  // seeds 2 to 4): it turns few answers, and makes the wrong ones less sure; with none odd nothing.
  constexpr double kWorth = 10.0;
  constexpr double kOdd = kShare * kWorth, kSound = kWorth - kOdd;
  double cost = 0.0;
  for (int i = 0; i < num_clutter; ++i)
    cost += std::log((kSound + num_features - 1 - i) / (kOdd + i));
  return cost;
}

// Log of the information, the inverse of the covariance's determinant, that a circle's own fit has
// of its normal: two degrees of freedom, of the better known of its two planes.
double LogNormalInformation(const CircleObservation& circle) {
  constexpr double kUnknown = 2.0 * 2.0 * 6.9;  // Two milliradians.
  if (!circle.fit) return kUnknown;
  std::array<CirclePlane, 2> planes;
  const int count = CirclePlanes(*circle.fit, &planes);
  if (count == 0) return kUnknown;
  double most = 0.0;
  for (int i = 0; i < count; ++i) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> normals(
        planes[static_cast<std::size_t>(i)].covariance, Eigen::EigenvaluesOnly);
    most = std::max(most, -std::log(normals.eigenvalues()[1] * normals.eigenvalues()[2]));
  }
  return std::isfinite(most) ? most : kUnknown;
}

// The same of a line's fit: of where its direction may be seen, one degree of freedom, or of the
// whole line, two; of a prior's direction, two, or turn, three.
double LogTurnInformation(const Eigen::Matrix3d& covariance, int dimensions) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(covariance, Eigen::EigenvaluesOnly);
  double log_information = 0.0;
  for (int k = 3 - dimensions; k < 3; ++k)
    log_information -= std::log(std::clamp(eigen.eigenvalues()[k], 1e-16, 1.0));
  return log_information;
}

// -log of the density of clutter over that of a feature at its mode, whatever the pose, and what it
// costs to be clutter.
double ClutterCost(const JointProblem& problem, const Feature& f, double share_cost) {
  constexpr double kAbout = 100.0;  // Standard deviations: where else a place might have been.
  const int dimensions = std::min(f.dof, f.kind == Feature::Kind::kPrior ? 3 : 2);
  // Rotations, normals that face the camera, or directions across a line.
  double volume = dimensions == 3 ? 8.0 * kPi * kPi : dimensions == 2 ? 2.0 * kPi : kPi;
  double log_information = 2.0 * std::log(1e3);  // Of a milliradian, a thousandth.
  switch (f.kind) {
    case Feature::Kind::kCircle:
      log_information = LogNormalInformation(
          problem.observations().circles[static_cast<std::size_t>(f.observation)]);
      break;
    case Feature::Kind::kLine:
    case Feature::Kind::kPlaneLine:
    case Feature::Kind::kAngle:
    case Feature::Kind::kPrior:
      if (f.covariance) log_information = LogTurnInformation(*f.covariance, dimensions);
      break;
    case Feature::Kind::kAxis:
      log_information = -2.0 * dimensions * std::log(problem.options().noise_model.pencil_axis_rad);
      break;
    case Feature::Kind::kCenterMark:
    case Feature::Kind::kPoint:
      volume = kAbout * kAbout;
      log_information = 0.0;
      break;
    case Feature::Kind::kLength:
      volume = 1.0;  // Of its logarithm.
      break;
  }
  double cost = share_cost + 0.5 * log_information - 0.5 * dimensions * std::log(2.0 * kPi) +
                std::log(volume);
  if (f.kind == Feature::Kind::kCircle && f.dof > 2) {
    constexpr double kRadiusSigma = 0.003;  // Relative; the radius might have been any other.
    cost -= std::log(std::sqrt(2.0 * kPi) * kRadiusSigma);
  }
  if (f.kind == Feature::Kind::kPrior)  // What more it knows is where the origin is.
    cost += (f.dof - dimensions) * std::log(kAbout / std::sqrt(2.0 * kPi));
  return std::max(0.0, cost);
}

// Makes all active that is left out but agrees with this pose, so that leaving it out costs more
// than keeping it. False where there is no such line or circle.
bool AdmitWhatFits(const JointProblem& problem, State* state) {
  bool any = false;
  for (std::size_t i = 0; i < state->active.size(); ++i) {
    if (state->active[i] != 0) continue;
    State with = *state;
    if (!problem.Admit(i, &with)) continue;
    // It alone, with what it is a part of and what is a part of it.
    const int own = static_cast<int>(i), parent = problem.feature(own).parent;
    State alone = with, without = with;
    without.active.assign(with.active.size(), 1);
    without.active[i] = 0;
    for (std::size_t k = 0; k < with.active.size(); ++k) {
      if (k != i && problem.features()[k].parent != own && static_cast<int>(k) != parent)
        alone.active[k] = 0;
    }
    State none = alone;
    none.active.assign(none.active.size(), 0);
    if (parent >= 0) none.active[static_cast<std::size_t>(parent)] = state->Has(parent) ? 1 : 0;
    if (DropOutliers(problem, &alone)) continue;
    const double cost = problem.Cost(alone) - problem.Cost(none);
    if (!(cost < LeftOutCost(problem, without))) continue;
    *state = std::move(with);
    any = true;
  }
  return any;
}

}  // namespace

double LeftOutCost(const JointProblem& problem, const State& state) {
  const std::vector<Feature>& features = problem.features();
  double cost = 0.0;
  int num_features = 0;
  std::vector<const Feature*> clutter;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const Feature& f = features[i];
    const bool parent_is_out = f.parent >= 0 && !state.Has(f.parent);
    const bool takes_part = problem.TakesPart(i, state.active);
    if (!takes_part) cost += 0.5 * f.free_twice_cost;
    if (parent_is_out) continue;
    ++num_features;
    if (!takes_part) clutter.push_back(&f);
  }
  if (clutter.empty()) return cost;
  const int num_clutter = static_cast<int>(clutter.size());
  const double share_cost = ClutterShareCost(num_clutter, num_features) / num_clutter;
  for (const Feature* f : clutter) cost += ClutterCost(problem, *f, share_cost);
  return cost;
}

void TakeBackWhatFits(const JointProblem& problem, State* minimum) {
  for (State with = *minimum; AdmitWhatFits(problem, &with);) {
    if (!problem.Solve(problem.options().max_iterations, &with).ok()) return;
    with.cost += LeftOutCost(problem, with);
    if (!(with.cost < minimum->cost)) return;
    *minimum = with;
  }
}

}  // namespace circline
