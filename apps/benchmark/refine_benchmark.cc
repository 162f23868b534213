// What the joint refinement costs: one core, CPU time, covariance included.
#include <benchmark/benchmark.h>

#include <Eigen/Dense>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "apps/benchmark/rows.h"
#include "circline/refine/estimate_pose.h"
#include "circline/refine/joint/joint_problem.h"
#include "circline/refine/joint/joint_result.h"
#include "tests/plane_scene.h"

namespace circline {
namespace {

constexpr double kNoisePx = 0.3;

// A tilted plane seen by a wide-angle camera with distortion.
struct Scene {
  explicit Scene(std::uint64_t seed)
      : plane(0.5 + 0.4 * static_cast<double>(seed) / kScenes, kNoisePx, seed) {
    Camera& camera = plane.camera;
    camera.width = 1280;
    camera.height = 960;
    camera.fx = camera.fy = 1000.0;
    camera.cx = 640.0;
    camera.cy = 480.0;
    plane.pose.translation.z() = 14.0;
    observations.frame.plane = "p0";
  }

  void AddCircle(double x, double y, double radius, int points) {
    const std::string id = "c" + std::to_string(observations.circles.size());
    observations.circles.push_back(plane.Circle(id, x, y, radius, points));
  }

  // `lines` lines along X and as many along Y, side by side, `points` on each.
  void AddGrid(int lines, int points) {
    PencilObservation along[2];
    for (std::size_t k = 0; k < 2; ++k) {
      along[k].direction = k == 0 ? PencilDirection::kX : PencilDirection::kY;
      along[k].id = PencilDirectionName(along[k].direction);
      along[k].plane = "p0";
      along[k].sigma_px = kNoisePx;
      for (int i = 0; i < lines; ++i) {
        const double at = -3.0 + 6.0 * i / (lines - 1);
        along[k].lines.push_back(k == 0 ? plane.Line({-3.0, at, 0.0}, {3.0, at, 0.0}, points)
                                        : plane.Line({at, -3.0, 0.0}, {at, 3.0, 0.0}, points));
      }
      observations.pencils.push_back(along[k]);
    }
  }

  PlaneScene plane;
  Observations observations;
};

// 100 contour points and 4 lines of 50.
void AddPaperLike(Scene* scene) {
  scene->AddCircle(0.0, 0.0, 2.0, 100);
  scene->AddGrid(2, 50);
}

// The same through a camera without distortion: undistorting 300 points takes a third of the time.
void AddPaperLikeUndistorted(Scene* scene) {
  scene->plane.camera.model = CameraModel::kPinhole;
  scene->plane.camera.distortion = {};
  AddPaperLike(scene);
}

// One contour of 100 points.
void AddOneCircle(Scene* scene) { scene->AddCircle(0.5, 0.3, 2.0, 100); }

// 20 circles of 60 points, 200 segments by their end points.
void AddManyFeatures(Scene* scene) {
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 5; ++column)
      scene->AddCircle(-2.4 + 1.2 * column, -1.8 + 1.2 * row, 0.5, 60);
  }
  scene->AddGrid(100, 2);
}

std::vector<Scene> Scenes(void (*add)(Scene*), bool fitted = true) {
  std::vector<Scene> scenes;
  for (std::uint64_t seed = 0; seed < kScenes; ++seed) {
    Scene& scene = scenes.emplace_back(seed);
    add(&scene);
    scene.observations.camera = scene.plane.camera;
    if (fitted) FitDirect(kNoisePx, &scene.observations);
  }
  return scenes;
}

void Require(bool is_ok) {
  if (!is_ok) std::abort();
}

EstimationOptions WithLoss(LossType loss) {
  EstimationOptions options;
  options.conic_loss.type = options.line_loss.type = loss;
  return options;
}

// From observations with fits and a seed `error` radians and 1 % off to pose and covariance.
void RefineOneSeed(benchmark::State& state, void (*add)(Scene*), const EstimationOptions& options,
                   double error) {
  std::vector<Scene> scenes = Scenes(add);
  for (Scene& scene : scenes) scene.observations = ResolveWorld(scene.observations);
  RunInTurn(state, scenes, [&](const Scene& scene) {
    const JointProblem problem(scene.observations, options);
    CameraPose seed = scene.plane.pose;
    seed.rotation = ExpRotation({error, -error, error}) * seed.rotation;
    seed.translation.x() += 10.0 * error;
    State at;
    Refined refined;
    Require(problem.Start(seed, 0.0, problem.FirstReading(), &at).ok() &&
            problem.SolveGraduated(options.max_iterations, &at).ok() &&
            FillRefined(problem, at, &refined).ok());
    return refined;
  });
}

// A closed form is off by about 0.01 rad; the pose of the frame before by less.
constexpr double kCold = 0.01, kWarm = 0.001;

void BM_RefineCircleAndLines(benchmark::State& state, LossType loss, double error) {
  RefineOneSeed(state, AddPaperLike, WithLoss(loss), error);
}
BENCHMARK_CAPTURE(BM_RefineCircleAndLines, cold_cauchy, LossType::kCauchy, kCold);
BENCHMARK_CAPTURE(BM_RefineCircleAndLines, cold_tukey, LossType::kTukey, kCold);
BENCHMARK_CAPTURE(BM_RefineCircleAndLines, cold_trivial, LossType::kTrivial, kCold);
BENCHMARK_CAPTURE(BM_RefineCircleAndLines, warm_cauchy, LossType::kCauchy, kWarm);

void BM_RefineUndistortedCircleAndLines(benchmark::State& state, LossType loss, double error) {
  RefineOneSeed(state, AddPaperLikeUndistorted, WithLoss(loss), error);
}
BENCHMARK_CAPTURE(BM_RefineUndistortedCircleAndLines, cold_cauchy, LossType::kCauchy, kCold);
BENCHMARK_CAPTURE(BM_RefineUndistortedCircleAndLines, cold_trivial, LossType::kTrivial, kCold);
BENCHMARK_CAPTURE(BM_RefineUndistortedCircleAndLines, warm_cauchy, LossType::kCauchy, kWarm);

void BM_RefineOrthogonalDistances(benchmark::State& state, LossType loss, double error) {
  EstimationOptions options = WithLoss(loss);
  options.conic_distance = ConicDistanceType::kOrthogonal;
  RefineOneSeed(state, AddPaperLikeUndistorted, options, error);
}
BENCHMARK_CAPTURE(BM_RefineOrthogonalDistances, cold_cauchy, LossType::kCauchy, kCold);

void BM_RefineFocalLength(benchmark::State& state, LossType loss, double error) {
  EstimationOptions options = WithLoss(loss);
  options.camera_sigma = CameraSigma();
  options.camera_sigma->log_focal = 0.03;
  RefineOneSeed(state, AddPaperLike, options, error);
}
BENCHMARK_CAPTURE(BM_RefineFocalLength, cold_cauchy, LossType::kCauchy, kCold);

void BM_RefineOneCircle(benchmark::State& state, LossType loss, double error) {
  RefineOneSeed(state, AddOneCircle, WithLoss(loss), error);
}
BENCHMARK_CAPTURE(BM_RefineOneCircle, cold_cauchy, LossType::kCauchy, kCold);

void BM_RefineManyFeatures(benchmark::State& state, LossType loss, double error) {
  RefineOneSeed(state, AddManyFeatures, WithLoss(loss), error);
}
BENCHMARK_CAPTURE(BM_RefineManyFeatures, cold_cauchy, LossType::kCauchy, kCold);

// From points alone to all poses, ranked.
void Estimate(benchmark::State& state, void (*add)(Scene*), bool fitted) {
  RunInTurn(state, Scenes(add, fitted), [&](const Scene& scene) {
    PoseEstimate estimate = EstimatePose(scene.observations);
    Require(estimate.status.ok());
    return estimate;
  });
}

void BM_EstimatePoseCircleAndLines(benchmark::State& state) { Estimate(state, AddPaperLike, true); }
BENCHMARK(BM_EstimatePoseCircleAndLines);

void BM_EstimatePoseCircleAndLinesUnfitted(benchmark::State& state) {
  Estimate(state, AddPaperLike, false);
}
BENCHMARK(BM_EstimatePoseCircleAndLinesUnfitted);

// As a front end calls it: with the pose of the frame before.
void BM_EstimatePoseFromPrior(benchmark::State& state) {
  RunInTurn(state, Scenes(AddPaperLike), [&](const Scene& scene) {
    EstimationOptions options;
    options.prior = scene.plane.pose;
    options.prior->rotation = ExpRotation({kWarm, -kWarm, kWarm}) * scene.plane.pose.rotation;
    PoseEstimate estimate = EstimatePose(scene.observations, options);
    Require(estimate.status.ok());
    return estimate;
  });
}
BENCHMARK(BM_EstimatePoseFromPrior);

void BM_EstimatePoseOneCircle(benchmark::State& state) { Estimate(state, AddOneCircle, true); }
BENCHMARK(BM_EstimatePoseOneCircle);

void BM_EstimatePoseManyFeatures(benchmark::State& state) {
  Estimate(state, AddManyFeatures, true);
}
BENCHMARK(BM_EstimatePoseManyFeatures);

}  // namespace
}  // namespace circline
