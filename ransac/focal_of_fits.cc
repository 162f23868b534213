#include "circline/ransac/focal_of_fits.h"

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

Observations At(double log_focal, const Observations& observations) {
  Observations result = observations;
  result.camera.fx *= std::exp(log_focal);
  result.camera.fy *= std::exp(log_focal);
  return result;
}

}  // namespace

bool FocalBendsCurves(const Camera& camera, const CameraSigma& sigma) {
  if (!sigma.IsWide()) return false;
  if (camera.model == CameraModel::kFisheye) return true;
  return camera.model == CameraModel::kOpenCV && !sigma.IsLensOpen() &&
         std::any_of(camera.distortion.begin(), camera.distortion.end(),
                     [](double k) { return k != 0.0; });
}

void TakeFocalOfFits(const CameraSigma& sigma, const std::function<void(Observations*)>& fit_points,
                     Observations* observations) {
  constexpr double kReach = 2.0;         // Standard deviations.
  constexpr double kMostLogFocal = 1.4;  // To a quarter and four times, at the most.
  constexpr double kClearly = 3.0;       // 20 to 1.
  const double prior = sigma.LargestLogFocal();
  const double reach = std::min(kReach * prior, kMostLogFocal);
  const auto posterior = [&](double log_focal) {
    Observations fitted = At(log_focal, *observations);
    fit_points(&fitted);
    return LogLikelihood(fitted) - 0.5 * std::pow(log_focal / prior, 2);
  };
  const double given = posterior(0.0);
  double best = 0.0, likeliest = given;
  const auto look = [&](double log_focal) {
    if (std::abs(log_focal) > reach) return;
    const double gain = posterior(log_focal);
    if (gain > likeliest) {
      likeliest = gain;
      best = log_focal;
    }
  };
  constexpr double kStep = 0.35;
  for (double step = kStep; step <= reach; step += kStep) {
    look(step);
    look(-step);
  }
  for (const double step : {0.5 * kStep, 0.25 * kStep, 0.125 * kStep}) {
    const double middle = best;
    look(middle - step);
    look(middle + step);
  }
  if (best == 0.0 || likeliest < given + kClearly) return;
  const double stated = observations->camera.fx;
  *observations = At(best, *observations);
  observations->stated_focal_px = stated;
}

}  // namespace circline
