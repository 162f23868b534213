// Contours through FitObservations: noise that is stated or not, few inliers, two rims.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "apps/benchmark/robust_fit_options.h"
#include "apps/benchmark/robust_fit_scenes.h"
#include "apps/benchmark/robust_fit_table.h"
#include "apps/benchmark/timing.h"
#include "circline/estimators/basics.h"
#include "circline/estimators/noise_model.h"
#include "circline/ransac/fit_observations.h"
#include "tests/pinhole_camera.h"

namespace circline::apps {
namespace {

struct ContourRow {
  const char* name;
  ConicSceneOptions scene;
  bool is_stated;  // The noise.
  Bar bar;
};

ConicSceneOptions Contour(int num_inliers, double outlier_ratio, double sigma_px,
                          Clutter clutter = Clutter::kUniform) {
  ConicSceneOptions options;
  options.num_inliers = num_inliers;
  options.outlier_ratio = outlier_ratio;
  options.sigma_px = sigma_px;
  options.clutter = clutter;
  return options;
}

const ContourRow kRows[] = {
    {"sigma 2 px stated, 50 %", Contour(100, 0.5, 2.0), true, {98.0, 1.1, 0.0}},
    {"sigma 4 px stated, 50 %", Contour(100, 0.5, 4.0), true, {}},
    {"sigma 0.3 px unstated, 50 %", Contour(100, 0.5, 0.3), false, {98.0, 1.1, 0.0}},
    {"sigma 2 px unstated, 50 %", Contour(100, 0.5, 2.0), false, {98.0, 1.1, 0.0}},
    {"sigma 4 px unstated, 50 %", Contour(100, 0.5, 4.0), false, {}},
    {"30 of 100, sigma 1 px", Contour(30, 0.7, 1.0), true, {80.0, 0.0, 0.0}},
    {"40 % of a second rim, both",
     Contour(100, 2.0 / 7.0, 1.0, Clutter::kRim),
     true,
     {98.0, 0.0, 0.0}},
};

Observations Observe(const ConicScene& scene, bool is_stated, bool with_directions) {
  Observations observations;
  observations.camera = PinholeCamera();
  CircleObservation circle;
  circle.id = "c";
  circle.points = scene.pixels;
  if (with_directions) circle.normals = scene.directions.normals;
  if (is_stated) circle.sigma_px = scene.sigma_px;
  observations.circles.push_back(circle);
  return observations;
}

// Of the first reading. A second one must follow the second rim, at least within 3 sigma where that
// is seen, or be none where there is none.
double ErrorOf(const ConicScene& scene, const CircleObservation& circle) {
  if (!circle.fit || circle.second.has_value() == scene.rim.empty()) return kLost;
  if (circle.second && !(scene.RimError(circle.second->fit.conic) <= 3.0)) return kLost;
  const double error = scene.Error(circle.fit->conic);
  return std::isfinite(error) ? error : kLost;
}

void RunRow(const ContourRow& row, bool with_directions) {
  ConicSceneOptions options = row.scene;
  options.direction_sigma_rad = FLAGS_direction_sigma_deg * kDegree;
  FitOptions fit_options;
  fit_options.noise_model = NoiseModel::Exact();
  Tally tally;
  for (int trial = 0; trial < FLAGS_trials; ++trial) {
    const ConicScene scene = MakeConicScene(options, TrialSeed(trial));
    Observations observations = Observe(scene, row.is_stated, with_directions);
    const double ms = Milliseconds([&] { (void)FitObservations(fit_options, &observations); });
    tally.Add(ErrorOf(scene, observations.circles.front()), ms);
  }
  PrintRow(row.name, with_directions ? "ours, with directions" : "ours, points", tally, row.bar);
}

}  // namespace

void RunContours() {
  PrintHead("Contours through FitObservations: 100 points if no more is said, semi-axes 100, 60 px",
            "median C");
  for (const ContourRow& row : kRows) {
    if (!Wanted(row.name)) continue;
    RunRow(row, false);
    RunRow(row, true);
  }
}

}  // namespace circline::apps
