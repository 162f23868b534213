#include "circline/ransac/stated_noise.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "circline/estimators/point_noise.h"

namespace circline {
namespace {

std::ptrdiff_t NumInliers(const CircleObservation& circle) {
  const std::vector<std::uint8_t>& mask = circle.inliers;
  return std::count(mask.begin(), mask.end(), 1);
}

}  // namespace

std::string StatedNoiseProblem(const FitOptions& options, const Camera& camera,
                               const CircleObservation& circle) {
  constexpr double kFarLarger = 3.0;  // Times the stated noise.
  const auto num_points = static_cast<std::ptrdiff_t>(circle.points.size());
  if (!(circle.sigma_px > 0.0) || 2 * NumInliers(circle) >= num_points) return "";
  Observations unstated;
  unstated.camera = camera;
  unstated.circles = {circle};
  CircleObservation& other = unstated.circles[0];
  other.sigma_px = 0.0;
  if (!FitObservations(options, &unstated).ok() || !other.fit) return "";
  const double noise = MeasurePointNoise(unstated, options.noise_model).circles[0];
  const double ratio = noise / circle.sigma_px;
  if (ratio < kFarLarger || NumInliers(other) < 2 * NumInliers(circle)) return "";
  char text[200];
  std::snprintf(text, sizeof(text),
                "its points lie %.3g px from the best ellipse, %.2g times the %.3g px stated as "
                "their noise (sigma_px): state none, or a larger one",
                noise, ratio, circle.sigma_px);
  return text;
}

}  // namespace circline
