// Which points a minimum explains.
#include <algorithm>
#include <cmath>
#include <vector>

#include "circline/refine/joint/joint_result.h"

namespace circline {
namespace {

// Calls visit(feature, points, distances) for each contour and line that takes part.
template <typename Visit>
void ForEachCurve(const JointProblem& problem, const State& state, const Visit& visit) {
  std::vector<double> distances;
  const double* parameters[kMostBlocks];
  for (const Term* term : problem.ActiveTerms(state)) {
    const ImagePoints* points = term->weighed != nullptr ? term->weighed->points() : nullptr;
    if (points == nullptr) continue;
    problem.Parameters(*term, state.x.data(), parameters);
    term->weighed->Distances(parameters, &distances);
    visit(term->feature, *points, distances);
  }
}

// Calls visit(feature, cost, miss) for each single point that takes part.
template <typename Visit>
void ForEachPoint(const JointProblem& problem, const State& state, const Visit& visit) {
  const double* parameters[kMostBlocks];
  for (const Term* term : problem.ActiveTerms(state)) {
    const auto* cost = dynamic_cast<const PlanePointCost*>(term->weighed);
    if (cost == nullptr) continue;
    problem.Parameters(*term, state.x.data(), parameters);
    visit(term->feature, *cost, cost->MissPx(parameters));
  }
}

// Within the gate of its own noise.
bool IsInlier(double distance, const ImagePoints& points) {
  return std::abs(distance) <= kInlierSigmas * points.options().sigma_px;
}

}  // namespace

double CountInliers(const JointProblem& problem, const State& state, PoseHypothesis* h) {
  double squares_px = 0.0;
  double squares = 0.0, slopes = 0.0, inliers = 0.0, points = 0.0, unknowns = 3.0;
  ForEachCurve(problem, state,
               [&](int f, const ImagePoints& set, const std::vector<double>& distances) {
                 const bool is_circle = problem.feature(f).kind == Feature::Kind::kCircle;
                 unknowns += is_circle ? 3.0 : 1.0;
                 points += static_cast<double>(distances.size());
                 for (const double d : distances) {
                   const double r = d / set.options().sigma_px, r2 = r * r;
                   const LossSlopes loss = LossSlopesAt(set.options().loss, r2);
                   squares += loss.first * loss.first * r2;
                   slopes += loss.first + 2.0 * r2 * loss.second;
                   if (!IsInlier(d, set)) continue;
                   inliers += 1.0;
                   squares_px += d * d;
                 }
               });
  h->num_observations = static_cast<int>(points);
  h->num_inliers = static_cast<int>(inliers);
  ForEachPoint(problem, state, [&](int, const PlanePointCost& cost, double miss) {
    ++h->num_observations;
    if (!(miss <= kInlierSigmas * cost.sigma_px())) return;
    ++h->num_inliers;
    squares_px += miss * miss;
  });
  h->rms_px = h->num_inliers > 0 ? std::sqrt(squares_px / h->num_inliers) : 0.0;

  constexpr double kTuned = 1.0 / 0.95, kEnough = 30.0;
  const EstimationOptions& options = problem.options();
  if (options.conic_loss.type == LossType::kTrivial && options.line_loss.type == LossType::kTrivial)
    return 1.0;
  if (!(points > unknowns + kEnough) || !(slopes > 0.0)) return kTuned;
  const double redundancy = points / (points - unknowns);
  return std::max(kTuned, redundancy * squares * inliers / (slopes * slopes));
}

bool DropOutliers(const JointProblem& problem, State* state) {
  std::vector<int> dropped;
  ForEachCurve(problem, *state,
               [&](int f, const ImagePoints& points, const std::vector<double>& distances) {
                 const auto inliers = std::count_if(distances.begin(), distances.end(),
                                                    [&](double d) { return IsInlier(d, points); });
                 const bool is_circle = problem.feature(f).kind == Feature::Kind::kCircle;
                 if (inliers < (is_circle ? 5 : 2)) dropped.push_back(f);
               });
  ForEachPoint(problem, *state, [&](int f, const PlanePointCost& cost, double miss) {
    constexpr double kFar = 5.0;  // Standard deviations: no single point is so far off by chance.
    if (!(miss <= kFar * cost.sigma_px())) dropped.push_back(f);
  });
  for (const int f : dropped) state->active[static_cast<std::size_t>(f)] = 0;
  return !dropped.empty();
}

}  // namespace circline
