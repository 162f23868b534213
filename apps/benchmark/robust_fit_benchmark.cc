// Robust fits of ellipses among outliers, beside what OpenCV and a plain RANSAC reach on the same
// data: 100 points of an ellipse with semi-axes 100 and 60 px, noise 1 px, edge directions good to
// 0.1 rad.
//
//     circline_robust_fit_benchmark --trials=200
//     circline_robust_fit_benchmark --rows=cluster --peers=false
//
// C is the error along the true curve over the Cramer-Rao bound of the inliers; a fit is ok if
// C <= 3; times are processor time of one fit.
#include <gflags/gflags.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "apps/benchmark/timing.h"
#include "apps/common/flags_util.h"
#include "circline/estimators/basics.h"
#include "circline/estimators/conic_fit.h"
#include "circline/estimators/random.h"
#include "circline/ransac/robust_conic.h"
#include "tests/ransac/conic_scene.h"

DEFINE_int32(trials, 200, "Data sets for each row; 1 or more.");
DEFINE_uint64(seed, 1, "Of the data sets.");
DEFINE_string(rows, "", "Only the rows whose name holds this.");
DEFINE_bool(peers, true, "Run the other methods too.");

namespace circline::apps {
namespace {

using conic_scene::Clutter;
using conic_scene::Scene;
using Eigen::Matrix3d;
using Eigen::Vector2d;

struct Method {
  const char* name;
  std::function<bool(const Scene&, Matrix3d*)> fit;
  bool is_ours;
};

// OpenCV's fits are of pixels.
std::vector<cv::Point2f> Pixels(const Scene& scene, const std::vector<std::uint8_t>& mask) {
  const Camera camera = conic_scene::TestCamera();
  std::vector<cv::Point2f> pixels;
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    const Vector2d& x = scene.points[i].x;
    if (!mask.empty() && mask[i] == 0) continue;
    pixels.emplace_back(static_cast<float>(camera.fx * x.x() + camera.cx),
                        static_cast<float>(camera.fy * x.y() + camera.cy));
  }
  return pixels;
}

bool FromOpenCv(const cv::RotatedRect& rect, Matrix3d* conic) {
  const Camera camera = conic_scene::TestCamera();
  Ellipse ellipse;
  ellipse.center = {static_cast<double>(rect.center.x), static_cast<double>(rect.center.y)};
  ellipse.a = 0.5 * static_cast<double>(rect.size.width);
  ellipse.b = 0.5 * static_cast<double>(rect.size.height);
  ellipse.angle = static_cast<double>(rect.angle) * kDegree;
  if (!(ellipse.a > 0.0 && ellipse.b > 0.0)) return false;
  Matrix3d pixel_from_x;
  pixel_from_x << camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0;
  *conic = TransformConic(EllipseToConic(ellipse), pixel_from_x);
  return conic->allFinite();
}

// Plain RANSAC: five points, inliers counted, the usual stopping rule.
bool PlainRansac(const Scene& scene, std::vector<std::uint8_t>* best) {
  constexpr double kMaxIterations = 10000.0;
  const RansacOptions options = RobustFitOptions().ransac;
  const int n = static_cast<int>(scene.points.size());
  Random random(options.seed);
  std::vector<std::uint8_t> mask(scene.points.size());
  std::array<Vector2d, 5> sample;
  int most = 0;
  double needed = kMaxIterations;
  for (int draw = 0; draw < needed; ++draw) {
    for (Vector2d& x : sample) x = scene.points[static_cast<std::size_t>(random.UniformInt(n))].x;
    Matrix3d conic;
    if (!ConicFromFivePoints(sample, &conic) || !NormalizeEllipse(conic, &conic)) continue;
    int count = 0;
    for (std::size_t i = 0; i < mask.size(); ++i) {
      mask[i] = std::abs(ConicDistancePx(scene.points[i], conic)) <= options.threshold ? 1 : 0;
      count += mask[i];
    }
    if (count <= most) continue;
    most = count;
    *best = mask;
    const double good = std::pow(static_cast<double>(count) / n, 5.0);
    needed = std::min(kMaxIterations, std::log(1.0 - options.confidence) / std::log1p(-good));
  }
  return most >= 5;
}

bool RansacThenFitEllipse(const Scene& scene, Matrix3d* conic) {
  std::vector<std::uint8_t> mask;
  return PlainRansac(scene, &mask) && FromOpenCv(cv::fitEllipse(Pixels(scene, mask)), conic);
}

bool Ours(const Scene& scene, const EdgeDirections* directions, Matrix3d* conic) {
  ConicFit fit;
  if (!FitConicRobust(scene.points, RobustFitOptions(), &fit, nullptr, ConicLimits(), directions)
           .ok()) {
    return false;
  }
  *conic = fit.conic;
  return true;
}

std::vector<Method> Methods() {
  const auto open_cv = [](cv::RotatedRect (*fit)(cv::InputArray)) {
    return [fit](const Scene& scene, Matrix3d* conic) {
      return FromOpenCv(fit(Pixels(scene, {})), conic);
    };
  };
  return {// OpenCV 4.6 has AMS and Direct fall back to fitEllipse, silently, from 200 points on.
          {"all points, fitEllipse", open_cv(cv::fitEllipse), false},
          {"all points, fitEllipseAMS", open_cv(cv::fitEllipseAMS), false},
          {"all points, fitEllipseDirect", open_cv(cv::fitEllipseDirect), false},
          {"RANSAC + fitEllipse", RansacThenFitEllipse, false},
          {"ours, points", [](const Scene& s, Matrix3d* c) { return Ours(s, nullptr, c); }, true},
          {"ours, with directions",
           [](const Scene& s, Matrix3d* c) { return Ours(s, &s.directions, c); }, true}};
}

struct Row {
  const char* name;
  double outlier_ratio, arc_deg;
  Clutter clutter;
};

const Row kRows[] = {
    {"10 %, full", 0.1, 360.0, Clutter::kUniform},
    {"30 %, full", 0.3, 360.0, Clutter::kUniform},
    {"50 %, full", 0.5, 360.0, Clutter::kUniform},
    {"70 %, full", 0.7, 360.0, Clutter::kUniform},
    {"70 %, 180 deg arc", 0.7, 180.0, Clutter::kUniform},
    {"70 %, 90 deg arc", 0.7, 90.0, Clutter::kUniform},
    {"90 %, full", 0.9, 360.0, Clutter::kUniform},
    {"second ellipse, 30 %", 0.3, 360.0, Clutter::kEllipse},
    {"second ellipse, 45 %", 0.45, 360.0, Clutter::kEllipse},
    {"straight edge, 50 %", 0.5, 360.0, Clutter::kEdge},
    {"straight edge, 70 %", 0.7, 360.0, Clutter::kEdge},
    {"cluster, 50 %", 0.5, 360.0, Clutter::kCluster},
    {"cluster, 70 %", 0.7, 360.0, Clutter::kCluster},
};

void RunRow(const Row& row, const Method& method) {
  constexpr double kOk = 3.0, kNotFound = 1e9;
  std::vector<double> errors, ms;
  for (int trial = 0; trial < FLAGS_trials; ++trial) {
    const Scene scene =
        conic_scene::MakeScene(1000 * FLAGS_seed + static_cast<std::uint64_t>(trial),
                               row.outlier_ratio, row.arc_deg, row.clutter);
    Matrix3d conic;
    bool is_found = false;
    ms.push_back(Milliseconds([&] { is_found = method.fit(scene, &conic); }));
    const double error = is_found ? scene.Error(conic) : kNotFound;
    errors.push_back(std::isfinite(error) ? error : kNotFound);
  }
  const auto num_ok =
      std::count_if(errors.begin(), errors.end(), [&](double error) { return error <= kOk; });
  std::printf("%-22s %-28s %6.1f %9.2f %9.3f\n", row.name, method.name,
              100.0 * static_cast<double>(num_ok) / FLAGS_trials, Quantile(errors, 0.5),
              Quantile(ms, 0.5));
  std::fflush(stdout);
}

int Run() {
  if (FLAGS_trials < 1) {
    SayOnStderr("circline_robust_fit_benchmark: --trials: must be 1 or more");
    return kExitUsage;
  }
  std::printf("%-22s %-28s %6s %9s %9s\n", "outliers", "method", "ok %", "median C", "ms");
  for (const Row& row : kRows) {
    if (std::string(row.name).find(FLAGS_rows) == std::string::npos) continue;
    for (const Method& method : Methods()) {
      if (FLAGS_peers || method.is_ours) RunRow(row, method);
    }
  }
  return kExitOk;
}

}  // namespace
}  // namespace circline::apps

int main(int argc, char** argv) {
  return circline::apps::RunApp(
      argc, argv, "circline_robust_fit_benchmark",
      "circline_robust_fit_benchmark: robust fits of ellipses beside their peers.",
      circline::apps::Run);
}
