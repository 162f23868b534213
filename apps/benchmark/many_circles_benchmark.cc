// How the time of an estimate grows with the number of circles, and of those that contradict it.
#include <benchmark/benchmark.h>

#include <cmath>
#include <string>

#include "circline/estimators/basics.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/random.h"
#include "circline/refine/estimate_pose.h"

namespace circline {
namespace {

constexpr double kNoisePx = 0.3;
constexpr int kPoints = 24;

// Circles of one plane, seen 40 degrees off its normal; where `every` is above 0, each every-th one
// leans out of it by 11 to 34 degrees.
Observations CirclesOfAPlane(std::int64_t count, std::int64_t every) {
  Random random(1);
  Observations observations;
  Camera& camera = observations.camera;
  camera.fx = camera.fy = 600.0;
  camera.cx = 320.0;
  camera.cy = 240.0;
  const Eigen::Matrix3d R = ExpRotation({0.7, 0.0, 0.0});
  for (std::int64_t i = 0; i < count; ++i) {
    const double x = random.Uniform(-2.0, 2.0), y = random.Uniform(-2.0, 2.0),
                 radius = random.Uniform(0.05, 0.2);
    const bool leans = every > 0 && i % every == 0;
    const Eigen::Matrix3d lean = ExpRotation({0.0, leans ? random.Uniform(0.2, 0.6) : 0.0, 0.0});
    CircleObservation circle;
    circle.id = "c" + std::to_string(i);
    circle.plane = "p";
    for (int k = 0; k < kPoints; ++k) {
      const double a = 2.0 * kPi * k / kPoints;
      const Eigen::Vector3d on = Eigen::Vector3d(x, y, 0.0) +
                                 radius * (lean * Eigen::Vector3d(std::cos(a), std::sin(a), 0.0));
      Eigen::Vector2d pixel;
      CameraToPixel(camera, R * on + Eigen::Vector3d(0.0, 0.0, 6.0), &pixel);
      const double dx = random.Normal(), dy = random.Normal();
      circle.points.push_back(pixel + kNoisePx * Eigen::Vector2d(dx, dy));
    }
    observations.circles.push_back(circle);
  }
  FitDirect(kNoisePx, &observations);
  return observations;
}

void BM_EstimatePoseCirclesOfAPlane(benchmark::State& state) {
  const Observations observations = CirclesOfAPlane(state.range(0), state.range(1));
  for (auto _ : state) benchmark::DoNotOptimize(EstimatePose(observations));
}
BENCHMARK(BM_EstimatePoseCirclesOfAPlane)
    ->ArgNames({"circles", "leaning_every"})
    ->ArgsProduct({{10, 30, 100, 300, 1000}, {0, 5}})
    ->Args({10000, 0})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace circline
