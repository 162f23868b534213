// Ellipses.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "apps/benchmark/robust_fit_options.h"
#include "apps/benchmark/robust_fit_scenes.h"
#include "apps/benchmark/robust_fit_table.h"
#include "circline/estimators/basics.h"
#include "circline/estimators/conic_fit.h"
#include "circline/estimators/random.h"
#include "circline/ransac/robust_conic.h"

namespace circline::apps {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;

using ConicMethod = Method<ConicScene, Matrix3d>;

bool FromOpenCv(const cv::RotatedRect& rect, Matrix3d* conic) {
  Ellipse ellipse;
  ellipse.center = {static_cast<double>(rect.center.x), static_cast<double>(rect.center.y)};
  ellipse.a = 0.5 * static_cast<double>(rect.size.width);
  ellipse.b = 0.5 * static_cast<double>(rect.size.height);
  ellipse.angle = static_cast<double>(rect.angle) * kDegree;
  if (!(ellipse.a > 0.0 && ellipse.b > 0.0)) return false;
  *conic = TransformConic(EllipseToConic(ellipse), PixelFromX());
  return conic->allFinite();
}

// Plain RANSAC: five points, inliers counted, the usual stopping rule.
bool PlainRansac(const ConicScene& scene, std::vector<std::uint8_t>* best) {
  const int n = static_cast<int>(scene.points.size());
  const double threshold = FLAGS_inlier_sigmas * scene.sigma_px;
  Random random(FLAGS_ransac_seed);
  std::vector<std::uint8_t> mask(scene.points.size());
  std::array<Vector2d, 5> sample;
  int most = 0;
  double needed = FLAGS_peer_max_iterations;
  for (int draw = 0; draw < needed; ++draw) {
    for (Vector2d& x : sample) x = scene.points[static_cast<std::size_t>(random.UniformInt(n))].x;
    Matrix3d conic;
    if (!ConicFromFivePoints(sample, &conic) || !NormalizeEllipse(conic, &conic)) continue;
    int count = 0;
    for (std::size_t i = 0; i < mask.size(); ++i) {
      mask[i] = std::abs(ConicDistancePx(scene.points[i], conic)) <= threshold ? 1 : 0;
      count += mask[i];
    }
    if (count <= most) continue;
    most = count;
    *best = mask;
    const double good = std::pow(static_cast<double>(count) / n, 5.0);
    needed = std::min<double>(FLAGS_peer_max_iterations,
                              std::log(1.0 - FLAGS_confidence) / std::log1p(-good));
  }
  return most >= 5;
}

bool RansacThenFitEllipse(const ConicScene& scene, Matrix3d* conic) {
  std::vector<std::uint8_t> mask;
  if (!PlainRansac(scene, &mask)) return false;
  return FromOpenCv(cv::fitEllipse(OpenCvPoints(scene.pixels, &mask)), conic);
}

bool RansacThenTukey(const ConicScene& scene, Matrix3d* conic) {
  if (!RansacThenFitEllipse(scene, conic)) return false;
  constexpr int kPasses = 20;
  constexpr double kTukey = 4.685;
  for (int pass = 0; pass < kPasses; ++pass) {
    std::vector<CalibratedPoint> points;
    std::vector<double> weights;
    for (const CalibratedPoint& p : scene.points) {
      const double u = ConicDistancePx(p, *conic) / (kTukey * scene.sigma_px);
      if (!(std::abs(u) < 1.0)) continue;
      points.push_back(p);
      weights.push_back((1.0 - u * u) * (1.0 - u * u));
    }
    ConicFit fit;
    if (!RefineConic(points, scene.sigma_px, *conic, &fit, &weights).ok()) return true;
    *conic = fit.conic;
  }
  return true;
}

bool Ours(const ConicScene& scene, const EdgeDirections& directions, Matrix3d* conic) {
  ConicFit fit;
  if (!FitConicRobust(scene.points, PixelOptions(), &fit, nullptr, directions).ok()) return false;
  *conic = fit.conic;
  return true;
}

bool OursOnPoints(const ConicScene& scene, Matrix3d* conic) { return Ours(scene, {}, conic); }

bool OursWithDirections(const ConicScene& scene, Matrix3d* conic) {
  return Ours(scene, scene.directions, conic);
}

std::vector<ConicMethod> ConicMethods(bool all_points) {
  const auto open_cv = [](cv::RotatedRect (*fit)(cv::InputArray)) {
    return [fit](const ConicScene& scene, Matrix3d* conic) {
      return FromOpenCv(fit(OpenCvPoints(scene.pixels)), conic);
    };
  };
  std::vector<ConicMethod> methods;
  if (FLAGS_peers && all_points) {
    // OpenCV 4.6 has AMS and Direct fall back to fitEllipse, silently, from 200 points on.
    methods.push_back({"all points, fitEllipse", open_cv(cv::fitEllipse), false});
    methods.push_back({"all points, fitEllipseAMS", open_cv(cv::fitEllipseAMS), false});
    methods.push_back({"all points, fitEllipseDirect", open_cv(cv::fitEllipseDirect), false});
  }
  if (FLAGS_peers) {
    methods.push_back({"RANSAC + fitEllipse", RansacThenFitEllipse, false});
    methods.push_back({"RANSAC + Tukey", RansacThenTukey, false});
  }
  methods.push_back({"ours, points", OursOnPoints, true});
  methods.push_back({"ours, with directions", OursWithDirections, true});
  return methods;
}

struct ConicRow {
  const char* name;
  double outlier_ratio, arc_deg;
  Clutter clutter;
  Bar bar;
};

void RunConicRow(const ConicRow& row) {
  if (!Wanted(row.name)) return;
  ConicSceneOptions options;
  options.outlier_ratio = row.outlier_ratio;
  options.arc_deg = row.arc_deg;
  options.clutter = row.clutter;
  options.sigma_px = FLAGS_sigma_px;
  options.direction_sigma_rad = FLAGS_direction_sigma_deg * kDegree;
  std::vector<ConicScene> scenes;
  for (int trial = 0; trial < FLAGS_trials; ++trial) {
    scenes.push_back(MakeConicScene(options, TrialSeed(trial)));
    scenes.back().directions.sigma_rad = std::max(options.direction_sigma_rad, 1e-3);
  }
  FitAndPrintRows(row.name, scenes, ConicMethods(row.clutter == Clutter::kUniform), row.bar);
}

const ConicRow kConicRows[] = {
    {"10 %, full", 0.1, 360.0, Clutter::kUniform, {100.0, 1.05, 0.1}},
    {"30 %, full", 0.3, 360.0, Clutter::kUniform, {100.0, 1.05, 0.1}},
    {"50 %, full", 0.5, 360.0, Clutter::kUniform, {100.0, 1.05, 1.5}},
    {"70 %, full", 0.7, 360.0, Clutter::kUniform, {100.0, 1.10, 4.0}},
    {"70 %, 180 deg arc", 0.7, 180.0, Clutter::kUniform, {99.0, 1.25, 4.0}},
    {"70 %, 90 deg arc", 0.7, 90.0, Clutter::kUniform, {99.0, 1.25, 4.0}},
    {"90 %, full", 0.9, 360.0, Clutter::kUniform, {95.0, 0.0, 0.0}},
    {"70 %, 180 deg, in its box", 0.7, 180.0, Clutter::kArcBox, {}},
    {"70 %, 90 deg, in its box", 0.7, 90.0, Clutter::kArcBox, {}},
};

const ConicRow kStructuredRows[] = {
    {"second ellipse, 30 %", 0.3, 360.0, Clutter::kEllipse, {99.0, 0.0, 0.0}},
    {"second ellipse, 45 %", 0.45, 360.0, Clutter::kEllipse, {99.0, 0.0, 0.0}},
    {"straight edge, 50 %", 0.5, 360.0, Clutter::kEdge, {99.0, 0.0, 0.0}},
    {"straight edge, 70 %", 0.7, 360.0, Clutter::kEdge, {99.0, 0.0, 0.0}},
    {"cluster, 30 %", 0.3, 360.0, Clutter::kCluster, {99.0, 0.0, 0.0}},
    {"cluster, 50 %", 0.5, 360.0, Clutter::kCluster, {99.0, 0.0, 0.0}},
    {"cluster, 70 %", 0.7, 360.0, Clutter::kCluster, {99.0, 0.0, 0.0}},
};

}  // namespace

void RunConics() {
  char title[160];
  std::snprintf(title, sizeof(title),
                "Conics: 100 points, semi-axes 100 and 60 px, sigma %g px, directions %g deg, "
                "%d trials",
                FLAGS_sigma_px, FLAGS_direction_sigma_deg, FLAGS_trials);
  PrintHead(title, "median C");
  for (const ConicRow& row : kConicRows) RunConicRow(row);
  PrintHead("Conics among structured outliers", "median C");
  for (const ConicRow& row : kStructuredRows) RunConicRow(row);
}

}  // namespace circline::apps
