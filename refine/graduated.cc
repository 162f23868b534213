#include "circline/refine/graduated.h"

#include <algorithm>
#include <cmath>

#include "circline/refine/minimize.h"

namespace circline {
namespace {

// Twice the largest |residual| / tuning constant but for the worst hundredth, of the points that a
// robust fit has not found to be outliers. Tukey's and Geman-McClure's losses are convex up to 0.45
// and 0.58 of theirs. 1 or less: nothing lies in the tails.
double RelativeSpread(const JointEvidence& e, const JointState& state) {
  std::vector<double> ratios;
  ForEachCurve(e, state,
               [&](const PointSet& set, bool, std::size_t, const std::vector<double>& distances) {
                 if (set.is_contaminated) return;  // Started robustly.
                 const double unit = 1.0 / (set.sigma_px * LossTuningConstant(set.loss));
                 for (std::size_t i = 0; i < set.num_trusted; ++i)
                   ratios.push_back(std::abs(distances[i]) * unit);
               });
  if (ratios.empty()) return 0.0;
  const auto quantile = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() * 99 / 100);
  std::nth_element(ratios.begin(), quantile, ratios.end());
  constexpr double kConvex = 2.0;
  return kConvex * *quantile;
}

constexpr double kFarOut = 3.0;  // Gaussian noise alone has a spread of 2.2.

}  // namespace

Eigen::Matrix3d ImageOf(const CircleTerm& t, const JointState& state) {
  const double* c = state.At(t.center);
  const double radius = t.radius < 0 ? c[2] : t.factor * state.At(t.radius)[0];
  return ImageOfPlaneCircle(state.rotation, state.facing, c[0], c[1], radius);
}

double NeededStretch(const JointEvidence& e, const JointState& state) {
  const double spread = RelativeSpread(e, state);
  return spread > kFarOut ? spread : 1.0;
}

Status GraduatedMinimize(const JointEvidence& e, int max_iterations, double tolerance,
                         JointState* state) {
  constexpr double kShrink = 0.5;
  constexpr int kIterationsOnTheWay = 2;
  double stretch = RelativeSpread(e, *state);
  while (stretch > kFarOut) {
    const Status status =
        Minimize(e, stretch, std::min(kIterationsOnTheWay, max_iterations), tolerance, state);
    if (!status.ok()) return status;
    stretch = std::min(kShrink * stretch, RelativeSpread(e, *state));
  }
  return Minimize(e, 1.0, max_iterations, tolerance, state);
}

}  // namespace circline
