#include "circline/ransac/stated_noise.h"

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <utility>
#include <vector>

#include "circline/estimators/point_noise.h"
#include "circline/estimators/statistics.h"

namespace circline {
namespace {

// How many points there are, and how many of them are outliers.
struct Points {
  std::ptrdiff_t all = 0, outliers = 0;

  explicit Points(const CircleObservation& circle) { Add(circle); }
  explicit Points(const PencilObservation& pencil) {
    for (const LineObservation& line : pencil.lines) Add(line);
  }
  explicit Points(const Observations& alone)
      : Points(alone.circles.empty() ? Points(alone.pencils[0]) : Points(alone.circles[0])) {}
  template <typename Feature>
  void Add(const Feature& feature) {
    const auto num_points = static_cast<std::ptrdiff_t>(feature.points.size());
    all += num_points;
    outliers += num_points - std::count(feature.inliers.begin(), feature.inliers.end(), 1);
  }
  bool AreManyOutliers() const { return outliers > 0 && 3 * outliers >= all; }
};

// Of a circle or a pencil alone, many of whose points are outliers.
std::string Problem(const FitOptions& options, Observations feature) {
  const Points before(feature);
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
  if (stated.empty() || !(Median(stated) > 0.0)) return "";
  FitOptions fit_options = options;
  fit_options.noise_model.camera = CameraSigma::Exact();  // No other camera is looked for.
  if (!FitObservations(fit_options, &feature).ok()) return "";
  const PointNoise noise = MeasurePointNoise(feature, options.noise_model);
  std::vector<double> measured = noise.circles;
  for (const std::vector<double>& lines : noise.lines)
    measured.insert(measured.end(), lines.begin(), lines.end());
  constexpr double kFarLarger = 3.0;  // Times the stated noise.
  const double stated_px = Median(stated), measured_px = Median(measured);
  const double ratio = measured_px / stated_px;
  if (ratio < kFarLarger || 2 * Points(feature).outliers > before.outliers) return "";
  char text[200];
  std::snprintf(text, sizeof(text),
                "its points lie %.3g px from the best %s, %.2g times the %.3g px stated as their "
                "noise (sigma_px): state none, or a larger one",
                measured_px, feature.circles.empty() ? "lines" : "ellipse", ratio, stated_px);
  return text;
}

}  // namespace

std::string StatedNoiseProblem(const FitOptions& options, const Camera& camera,
                               const CircleObservation& circle) {
  if (!Points(circle).AreManyOutliers()) return "";
  Observations alone;
  alone.camera = camera;
  alone.circles = {circle};
  return Problem(options, std::move(alone));
}

std::string StatedNoiseProblem(const FitOptions& options, const Camera& camera,
                               const PencilObservation& pencil) {
  if (!Points(pencil).AreManyOutliers()) return "";
  Observations alone;
  alone.camera = camera;
  alone.pencils = {pencil};
  return Problem(options, std::move(alone));
}

}  // namespace circline
