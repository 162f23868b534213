// Pencils of parallel segments.
#include <Eigen/LU>
#include <Eigen/SVD>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "apps/benchmark/robust_fit_options.h"
#include "apps/benchmark/robust_fit_scenes.h"
#include "apps/benchmark/robust_fit_table.h"
#include "apps/benchmark/timing.h"
#include "circline/ransac/robust_pencils.h"

namespace circline::apps {
namespace {

using Eigen::Matrix3d;

PencilOptions LineOptions() {
  PencilOptions options;
  options.ransac = EngineOptions();
  options.model_sigma_rad = 0.0;  // The segments are exactly parallel but for their noise.
  return options;
}

Matrix3d NearestRotation(Matrix3d directions) {
  if (directions.determinant() < 0.0) directions.col(2) *= -1.0;
  const Eigen::JacobiSVD<Matrix3d> svd(directions, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();
}

bool RotationFromPencils(const PencilScene& scene, Matrix3d* rotation) {
  std::vector<FoundPencil> pencils;
  if (!FindPencils(scene.lines, LineOptions(), &pencils).ok() || pencils.size() < 3) return false;
  Matrix3d directions;
  for (int k = 0; k < 3; ++k) {
    directions.col(k) = pencils[static_cast<std::size_t>(k)].fit.direction;
  }
  *rotation = NearestRotation(directions);
  return true;
}

// The inliers alone, known to belong to their directions: what the data allow, in these very
// trials.
bool RotationOfInliers(const PencilScene& scene, Matrix3d* rotation) {
  Matrix3d directions;
  for (int k = 0; k < 3; ++k) {
    const auto first = scene.lines.begin() + k * scene.per_direction;
    VanishingPointFit fit;
    if (!FitVanishingPoint({first, first + scene.per_direction}, &fit).ok()) return false;
    directions.col(k) = fit.direction;
  }
  *rotation = NearestRotation(directions);
  return true;
}

// The error of a row is rms error over the rms bound of three directions known to be orthogonal,
// which no fit of a single one makes use of: compare it with that of the inliers alone. Lost are
// errors beyond ten times the bound.
void RunPencilRow(const std::string& name, double clutter_ratio, const Bar& bar) {
  if (!Wanted(name)) return;
  const Method<PencilScene, Matrix3d> methods[] = {{"inliers alone", RotationOfInliers, false},
                                                   {"ours, one by one", RotationFromPencils, true}};
  constexpr double kTooFar = 10.0;  // Bounds.
  for (const auto& method : methods) {
    std::vector<double> times;
    double squares = 0.0, bounds = 0.0;
    int ok = 0, same = 0;
    for (int trial = 0; trial < FLAGS_trials; ++trial) {
      const PencilScene scene = MakePencilScene(30, clutter_ratio, TrialSeed(trial));
      Matrix3d rotation, again;
      bool found = false;
      times.push_back(Milliseconds([&] { found = method.fit(scene, &rotation); }));
      same += found && method.fit(scene, &again) && again == rotation ? 1 : 0;
      const double error = found ? scene.Error(rotation) : kLost;
      if (error > kTooFar * scene.rotation_bound) continue;
      ++ok;
      squares += error * error;
      bounds += scene.rotation_bound * scene.rotation_bound;
    }
    const double percent = 100.0 * ok / FLAGS_trials, ratio = std::sqrt(squares / bounds);
    std::printf("%-26s %-28s %6.1f %9.3f %9.3f  %ssame bits %d of %d\n", name.c_str(), method.name,
                percent, ratio, Quantile(times, 0.5),
                Verdict(method.ours ? bar : Bar(), percent, ratio, Quantile(times, 0.5)).c_str(),
                same, FLAGS_trials);
  }
}

}  // namespace

void RunPencils() {
  PrintHead("Pencils: 30 segments along each of three orthogonal directions, sigma 0.5 px",
            "rms/bound");
  RunPencilRow("pencils, clean", 0.0, {100.0, 0.0, 2.0});
  RunPencilRow("pencils, 50 %", 0.5, {100.0, 0.0, 2.0});
  RunPencilRow("pencils, 70 %", 0.7, {});
}

}  // namespace circline::apps
