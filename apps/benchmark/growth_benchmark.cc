// How the time of what the library and the programs do with one photo or one file grows with what
// is in it. The last line of each is the fit of n log n.
#include <benchmark/benchmark.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <string>
#include <vector>

#include "apps/common/scene.h"
#include "circline/estimators/basics.h"
#include "circline/estimators/random.h"
#include "circline/ransac/fit_observations.h"
#include "circline/refine/estimate_pose.h"

namespace circline {
namespace {

// An ellipse, three tenths of its points beside it.
Observations LongContour(std::int64_t count) {
  Random random(1);
  Observations observations;
  observations.camera.fx = observations.camera.fy = 600.0;
  CircleObservation circle;
  circle.id = "c";
  for (std::int64_t i = 0; i < count; ++i) {
    const double angle = 2.0 * kPi * static_cast<double>(i) / static_cast<double>(count);
    const double beside = i % 10 < 3 ? random.Uniform(5.0, 60.0) : 0.0;
    circle.points.emplace_back(200.0 * std::cos(angle) + beside + 0.2 * random.Normal(),
                               150.0 * std::sin(angle) + 0.2 * random.Normal());
  }
  observations.circles = {circle};
  return observations;
}

void BM_GrowthContourPoints(benchmark::State& state) {
  for (auto _ : state) {
    Observations observations = LongContour(state.range(0));
    if (!FitObservations({}, &observations).ok()) std::abort();
    benchmark::DoNotOptimize(EstimatePose(observations));
  }
  state.SetComplexityN(state.range(0));
}
BENCHMARK(BM_GrowthContourPoints)
    ->RangeMultiplier(10)
    ->Range(100, 100000)
    ->Unit(benchmark::kMillisecond)
    ->Complexity(benchmark::oNLogN);

void BM_GrowthSceneEntries(benchmark::State& state) {
  std::string text =
      "cameras: [{id: \"k\", model: \"pinhole\", width: 640, height: 480, "
      "camera_matrix: [600, 0, 320, 0, 600, 240, 0, 0, 1]}]\nimages:\n";
  for (std::int64_t i = 0; i < state.range(0); ++i)
    text += "  - {file: \"a.jpg\", camera: \"k\"}\n";
  for (auto _ : state) {
    std::vector<apps::SceneImage> images;
    if (!apps::ParseScene("scene", text, "", {}, &images).ok()) std::abort();
    benchmark::DoNotOptimize(images);
  }
  state.SetComplexityN(state.range(0));
}
BENCHMARK(BM_GrowthSceneEntries)
    ->RangeMultiplier(10)
    ->Range(100, 100000)
    ->Unit(benchmark::kMillisecond)
    ->Complexity(benchmark::oNLogN);

constexpr double kSegmentNoisePx = 0.2;

// A segment of a pencil, 20 to 90 pixels long.
LineObservation SegmentTo(const Eigen::Vector2d& vanishing_point, Random* random) {
  Eigen::Vector2d from(random->Uniform(-300.0, 300.0), random->Uniform(-200.0, 200.0));
  if ((vanishing_point - from).norm() < 200.0) from *= -1.0;
  const double length = random->Uniform(20.0, 90.0);
  const Eigen::Vector2d to = from + length * (vanishing_point - from).normalized();
  const auto noisy = [random](const Eigen::Vector2d& p) {
    const double dx = random->Normal(), dy = random->Normal();
    return Eigen::Vector2d(p + kSegmentNoisePx * Eigen::Vector2d(dx, dy));
  };
  return {{noisy(from), noisy(to)}, {}, {}};
}

void FitAndEstimate(const Observations& observations, benchmark::State* state) {
  for (auto _ : *state) {
    Observations fitted = observations;
    if (!FitObservations({}, &fitted).ok()) std::abort();
    benchmark::DoNotOptimize(EstimatePose(fitted));
  }
  state->SetComplexityN(state->range(0));
}

// Two orthogonal pencils; where `every` is above 0, each every-th segment of the first runs to a
// point 300 pixels beside the others' vanishing point.
void BM_GrowthSegments(benchmark::State& state) {
  Random random(1);
  Observations observations;
  observations.camera.fx = observations.camera.fy = 600.0;
  const std::array<Eigen::Vector2d, 2> vanishing_points = {Eigen::Vector2d(2000.0, 0.0),
                                                           Eigen::Vector2d(-180.0, 1800.0)};
  for (std::size_t k = 0; k < 2; ++k) {
    PencilObservation pencil;
    pencil.id = k == 0 ? "x" : "y";
    pencil.plane = "p";
    pencil.direction = k == 0 ? PencilDirection::kX : PencilDirection::kY;
    for (std::int64_t i = 0; i < state.range(0) / 2; ++i) {
      const bool leans = k == 0 && state.range(1) > 0 && i % state.range(1) == 0;
      const Eigen::Vector2d beside(0.0, leans ? 300.0 : 0.0);
      pencil.lines.push_back(SegmentTo(vanishing_points[k] + beside, &random));
    }
    observations.pencils.push_back(pencil);
  }
  FitAndEstimate(observations, &state);
}
BENCHMARK(BM_GrowthSegments)
    ->ArgNames({"segments", "leaning_every"})
    ->ArgsProduct({{100, 1000, 10000}, {0}})
    ->Unit(benchmark::kMillisecond)
    ->Complexity(benchmark::oNLogN);
BENCHMARK(BM_GrowthSegments)
    ->ArgNames({"segments", "leaning_every"})
    ->ArgsProduct({{100, 1000, 10000}, {10}})
    ->Unit(benchmark::kMillisecond)
    ->Complexity(benchmark::oNLogN);

// Pencils of three segments each, of any directions of one plane; its normal is (0, 0.6, -0.8).
void BM_GrowthFreePencils(benchmark::State& state) {
  Random random(1);
  Observations observations;
  observations.camera.fx = observations.camera.fy = 600.0;
  for (std::int64_t i = 0; i < state.range(0); ++i) {
    const double angle = random.Uniform(0.0, kPi);
    const Eigen::Vector3d direction(std::cos(angle), 0.8 * std::sin(angle), 0.6 * std::sin(angle));
    PencilObservation pencil;
    pencil.id = "l" + std::to_string(i);
    pencil.plane = "p";
    for (int k = 0; k < 3; ++k)
      pencil.lines.push_back(SegmentTo(600.0 * direction.head<2>() / direction.z(), &random));
    observations.pencils.push_back(pencil);
  }
  FitAndEstimate(observations, &state);
}
BENCHMARK(BM_GrowthFreePencils)
    ->RangeMultiplier(10)
    ->Range(10, 10000)
    ->Unit(benchmark::kMillisecond)
    ->Complexity(benchmark::oNLogN);

}  // namespace
}  // namespace circline
