#include "circline/ransac/camera_of_fits.h"

#include <algorithm>
#include <cmath>

namespace circline {
namespace {

// Logarithm of how likely the points are: those of a fit are off it by its scatter, others lie
// anywhere near. Common terms are left out; so are features of so few points that any curve
// explains them.
double LogLikelihood(const Observations& fitted) {
  constexpr double kNearPx = 40.0;   // Where an outlier may lie.
  constexpr double kLeastPx = 0.05;  // No photo's points are better.
  constexpr int kTellingPoints = 3;  // Beyond the curve's parameters.
  // Points that the camera cannot see, but has seen.
  double sum = -fitted.num_dropped_points * std::log(kNearPx);
  const auto add = [&](const auto& feature, int num_parameters) {
    const int n = static_cast<int>(feature.points.size());
    if (n < num_parameters + kTellingPoints) return;
    const int num_inliers =
        static_cast<int>(std::count(feature.inliers.begin(), feature.inliers.end(), 1));
    const int free = num_inliers - num_parameters;
    if (!feature.fit || free <= 0) {
      sum -= n * std::log(kNearPx);
      return;
    }
    const double sigma =
        std::max(kLeastPx, feature.fit->rms_px * std::sqrt(1.0 * num_inliers / free));
    // exp(-1/2) sqrt(1 / (2 pi)) / sigma, on average.
    sum -= num_inliers * (std::log(sigma) + 1.42) + (n - num_inliers) * std::log(kNearPx);
  };
  for (const CircleObservation& circle : fitted.circles) add(circle, 5);
  for (const PencilObservation& pencil : fitted.pencils) {
    for (const LineObservation& line : pencil.lines) add(line, 2);
  }
  return sum;
}

// How far from the value given one is looked for, and how finely.
struct Range {
  double prior;  // Standard deviation.
  double reach;  // At most.
  double step;   // Of the first looks; each of `halvings` then looks half as far to both sides,
  int halvings;  // and more do, up to `most_halvings`, where the likelihood has a narrower peak.
  int most_halvings;
};

// By how much the value is likelier another; 0 where that is not clear.
template <typename At>
double LikeliestShift(const Range& range, const FitPointsFn& fit_points,
                      const At& observations_at) {
  constexpr double kClearly = 3.0;  // 20 to 1.
  const auto posterior = [&](double shift) {
    Observations fitted = observations_at(shift);
    fit_points(&fitted);
    return LogLikelihood(fitted) - 0.5 * std::pow(shift / range.prior, 2);
  };
  const double given = posterior(0.0);
  double best = 0.0, likeliest = given;
  const auto look = [&](double shift) {
    if (std::abs(shift) > range.reach) return likeliest;
    const double there = posterior(shift);
    if (there > likeliest) {
      likeliest = there;
      best = shift;
    }
    return there;
  };
  for (double shift = range.step; shift <= range.reach; shift += range.step) {
    look(shift);
    look(-shift);
  }
  constexpr double kLess = 1.0;  // What one outlier more costs, or less.
  double step = range.step;
  bool is_narrow = false;
  for (int k = 0; k < range.halvings || (is_narrow && k < range.most_halvings); ++k) {
    step *= 0.5;
    const double middle = best;
    const double below = look(middle - step), above = look(middle + step);
    is_narrow = std::min(below, above) < likeliest - kLess;
  }
  return likeliest < given + kClearly ? 0.0 : best;
}

}  // namespace

void TakeFocalOfFits(const CameraSigma& sigma, const FitPointsFn& fit_points,
                     Observations* observations) {
  if (observations->stated_focal_px != 0.0 || !sigma.IsWide() ||
      !sigma.BendsWithFocal(observations->camera))
    return;
  constexpr double kMostLogFocal = 1.4;  // To a quarter and four times, at the most.
  const double prior = sigma.LargestLogFocal();
  const auto at = [&](double log_focal) {
    Observations result = *observations;
    result.camera.fx *= std::exp(log_focal);
    result.camera.fy *= std::exp(log_focal);
    return result;
  };
  // To 0.044, or to 0.0014: near the edge of what a strong lens sees points are many standard
  // deviations off their curve by 0.01.
  const Range range = {prior, std::min(2.0 * prior, kMostLogFocal), 0.35, 3, 8};
  const double likeliest = LikeliestShift(range, fit_points, at);
  if (likeliest == 0.0) return;
  const double stated = observations->camera.fx;
  *observations = at(likeliest);
  observations->stated_focal_px = stated;
}

void TakeLensOfFits(const CameraSigma& sigma, const FitPointsFn& fit_points,
                    Observations* observations) {
  // One known better bends a line across a photo of 60 degrees by half a pixel and less.
  constexpr double kWellKnownK1 = 0.01;
  constexpr double kMostK1 = 1.5;  // No further than lenses go.
  if (observations->camera.model == CameraModel::kPinhole || sigma.k1 < kWellKnownK1 ||
      observations->found_k1 != 0.0)
    return;
  const auto at = [&](double more_k1) {
    Observations result = *observations;
    result.camera.distortion[0] += more_k1;
    result.found_k1 = more_k1;
    return result;
  };
  // To 0.00625, half a pixel of the bow of the longest lines. First looks of 0.1 find the same, on
  // simulated lines and circles with up to a fifth of outliers, k1 from -0.4 to 0.1.
  const Range range = {sigma.k1, std::min(3.0 * sigma.k1, kMostK1), 0.2, 5, 5};
  const double likeliest = LikeliestShift(range, fit_points, at);
  if (likeliest != 0.0) *observations = at(likeliest);
}

}  // namespace circline
