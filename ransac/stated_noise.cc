#include "circline/ransac/stated_noise.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "circline/estimators/point_noise.h"

namespace circline {
namespace {

// How many points there are, and how many of them are outliers.
struct Points {
  std::ptrdiff_t all = 0, outliers = 0;

  explicit Points(const Observations& observations) {
    for (const CircleObservation& circle : observations.circles)
      Add(circle.points.size(), circle.inliers);
    for (const PencilObservation& pencil : observations.pencils) {
      for (const LineObservation& line : pencil.lines) Add(line.points.size(), line.inliers);
    }
  }
  void Add(std::size_t num_points, const std::vector<std::uint8_t>& mask) {
    all += static_cast<std::ptrdiff_t>(num_points);
    outliers += static_cast<std::ptrdiff_t>(num_points) - std::count(mask.begin(), mask.end(), 1);
  }
};

double Median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

std::string StatedNoiseProblem(const FitOptions& options, const std::string& curve,
                               Observations feature) {
  const Points before(feature);
  if (3 * before.outliers < before.all) return "";
  std::vector<double> stated;
  for (CircleObservation& circle : feature.circles) {
    stated.push_back(circle.sigma_px);
    circle.sigma_px = 0.0;
  }
  for (PencilObservation& pencil : feature.pencils) {
    for (LineObservation& line : pencil.lines) {
      stated.push_back(LineSigma(pencil, line));
      line.sigma_px = 0.0;
    }
    pencil.sigma_px = 0.0;
  }
  const double stated_px = Median(stated);
  feature.stated_focal_px = feature.camera.fx;  // No other is looked for.
  if (!(stated_px > 0.0) || !FitObservations(options, &feature).ok()) return "";
  const PointNoise noise = MeasurePointNoise(feature, options.noise_model);
  std::vector<double> measured = noise.circles;
  for (const std::vector<double>& lines : noise.lines)
    measured.insert(measured.end(), lines.begin(), lines.end());
  const double measured_px = Median(measured);
  constexpr double kFarLarger = 3.0;  // Times the stated noise.
  if (measured_px < kFarLarger * stated_px || 2 * Points(feature).outliers > before.outliers)
    return "";
  char text[200];
  std::snprintf(text, sizeof(text),
                "its points lie %.3g px from %s, %.2g times the %.3g px stated as their noise "
                "(sigma_px): state none, or a larger one",
                measured_px, curve.c_str(), measured_px / stated_px, stated_px);
  return text;
}

}  // namespace circline
