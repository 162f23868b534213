#include "circline/ransac/stated_noise.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <vector>

#include "circline/estimators/point_noise.h"
#include "circline/estimators/statistics.h"

namespace circline {
namespace {

// How many points a feature has, and how many of them are outliers.
struct Points {
  std::ptrdiff_t all = 0, outliers = 0;

  explicit Points(const CircleObservation& circle) { Add(circle.points.size(), circle.inliers); }
  explicit Points(const PencilObservation& pencil) {
    for (const LineObservation& line : pencil.lines) Add(line.points.size(), line.inliers);
  }
  void Add(std::size_t num_points, const std::vector<std::uint8_t>& mask) {
    all += static_cast<std::ptrdiff_t>(num_points);
    outliers += static_cast<std::ptrdiff_t>(num_points) - std::count(mask.begin(), mask.end(), 1);
  }
  bool AreManyOutliers() const { return 3 * outliers >= all; }
};

// No other camera than the one given is looked for.
FitOptions WithCameraGiven(FitOptions options) {
  options.noise_model.camera = CameraSigma::Exact();
  return options;
}

// Of a feature with the points `before`, which are those `after` where no noise is stated.
std::string Problem(const char* what, const Points& before, const Points& after, double stated_px,
                    double measured_px) {
  constexpr double kFarLarger = 3.0;  // Times the stated noise.
  const double ratio = measured_px / stated_px;
  if (ratio < kFarLarger || 2 * after.outliers > before.outliers) return "";
  char text[200];
  std::snprintf(text, sizeof(text),
                "its points lie %.3g px from %s, %.2g times the %.3g px stated as their noise "
                "(sigma_px): state none, or a larger one",
                measured_px, what, ratio, stated_px);
  return text;
}

}  // namespace

std::string StatedNoiseProblem(const FitOptions& options, const Camera& camera,
                               const CircleObservation& circle) {
  const Points before(circle);
  if (!(circle.sigma_px > 0.0) || !before.AreManyOutliers()) return "";
  Observations unstated;
  unstated.camera = camera;
  unstated.circles = {circle};
  unstated.circles[0].sigma_px = 0.0;
  if (!FitObservations(WithCameraGiven(options), &unstated).ok() || !unstated.circles[0].fit)
    return "";
  return Problem("the best ellipse", before, Points(unstated.circles[0]), circle.sigma_px,
                 MeasurePointNoise(unstated, options.noise_model).circles[0]);
}

std::string StatedNoiseProblem(const FitOptions& options, const Camera& camera,
                               const PencilObservation& pencil) {
  const Points before(pencil);
  if (!before.AreManyOutliers()) return "";
  std::vector<double> stated;
  Observations unstated;
  unstated.camera = camera;
  unstated.pencils = {pencil};
  unstated.pencils[0].sigma_px = 0.0;
  for (LineObservation& line : unstated.pencils[0].lines) {
    stated.push_back(LineSigma(pencil, line));
    line.sigma_px = 0.0;
  }
  if (stated.empty() || !(Median(stated) > 0.0)) return "";
  if (!FitObservations(WithCameraGiven(options), &unstated).ok()) return "";
  return Problem("the best lines", before, Points(unstated.pencils[0]), Median(stated),
                 Median(MeasurePointNoise(unstated, options.noise_model).lines[0]));
}

}  // namespace circline
