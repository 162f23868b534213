// What the joint refinement costs: one core, CPU time, covariance included.
#include <benchmark/benchmark.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/random.h"
#include "circline/refine/estimate_pose.h"
#include "circline/refine/joint_problem.h"
#include "circline/refine/joint_result.h"

namespace circline {
namespace {

constexpr double kNoisePx = 0.3;
constexpr std::size_t kScenes = 16;  // Taken in turn, so that no branch is learnt by heart.

// A tilted plane seen by a wide-angle camera with distortion.
class Scene {
 public:
  explicit Scene(std::uint64_t seed) : random_(seed) {
    Camera& camera = observations.camera;
    camera.model = CameraModel::kOpenCV;
    camera.width = 1280;
    camera.height = 960;
    camera.fx = camera.fy = 1000.0;
    camera.cx = 640.0;
    camera.cy = 480.0;
    camera.distortion = {-0.2, 0.05, 1e-3, -5e-4, 0.0};
    const double tilt = random_.Uniform(0.5, 0.9), turn = random_.Uniform(-0.5, 0.5);
    pose.rotation = ExpRotation({tilt, 0.1, 0.0}) * ExpRotation({0.0, 0.0, turn}) *
                    Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
    pose.translation = Eigen::Vector3d(0.3, -0.2, 14.0);
    observations.frame.plane = "p0";
  }

  void AddCircle(double x, double y, double radius, int points) {
    CircleObservation circle;
    circle.id = "c" + std::to_string(observations.circles.size());
    circle.plane = "p0";
    circle.sigma_px = kNoisePx;
    for (int i = 0; i < points; ++i) {
      const double a = 2.0 * kPi * i / points;
      circle.points.push_back(Pixel(x + radius * std::cos(a), y + radius * std::sin(a)));
    }
    observations.circles.push_back(circle);
  }

  // `lines` lines along X or Y, side by side, `points` on each.
  void AddPencil(PencilDirection direction, int lines, int points) {
    PencilObservation pencil;
    pencil.id = PencilDirectionName(direction);
    pencil.direction = direction;
    pencil.plane = "p0";
    pencil.sigma_px = kNoisePx;
    for (int i = 0; i < lines; ++i) {
      LineObservation line;
      const double across = -3.0 + 6.0 * i / (lines - 1);
      for (int k = 0; k < points; ++k) {
        const double along = -3.0 + 6.0 * k / (points - 1);
        line.points.push_back(direction == PencilDirection::kX ? Pixel(along, across)
                                                               : Pixel(across, along));
      }
      pencil.lines.push_back(line);
    }
    observations.pencils.push_back(pencil);
  }

  Observations observations;
  CameraPose pose;

 private:
  Eigen::Vector2d Pixel(double x, double y) {
    Eigen::Vector2d pixel;
    CameraToPixel(observations.camera,
                  pose.rotation * Eigen::Vector3d(x, y, 0.0) + pose.translation, &pixel);
    const double dx = random_.Normal(), dy = random_.Normal();
    return pixel + kNoisePx * Eigen::Vector2d(dx, dy);
  }

  Random random_;
};

// 100 contour points and 4 lines of 50.
void AddPaperLike(Scene* scene) {
  scene->AddCircle(0.0, 0.0, 2.0, 100);
  scene->AddPencil(PencilDirection::kX, 2, 50);
  scene->AddPencil(PencilDirection::kY, 2, 50);
}

// The same through a camera without distortion: undistorting 300 points takes a third of the time.
void AddPaperLikeUndistorted(Scene* scene) {
  scene->observations.camera.model = CameraModel::kPinhole;
  scene->observations.camera.distortion = {};
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
  scene->AddPencil(PencilDirection::kX, 100, 2);
  scene->AddPencil(PencilDirection::kY, 100, 2);
}

std::vector<Scene> Scenes(void (*add)(Scene*)) {
  std::vector<Scene> scenes;
  for (std::uint64_t seed = 1; seed <= kScenes; ++seed) {
    scenes.emplace_back(seed);
    add(&scenes.back());
  }
  return scenes;
}

// Calls `run` on every scene in turn.
template <typename Run>
void RunInTurn(benchmark::State& state, const std::vector<Scene>& scenes, const Run& run) {
  std::size_t i = 0;
  for (auto _ : state) {
    if (!run(i)) {
      state.SkipWithError("refused");
      break;
    }
    i = i + 1 < scenes.size() ? i + 1 : 0;
  }
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
  for (Scene& scene : scenes) {
    FitDirect(kNoisePx, &scene.observations);
    scene.observations = ResolveWorld(scene.observations);
  }
  RunInTurn(state, scenes, [&](std::size_t i) {
    const JointProblem problem(scenes[i].observations, options);
    CameraPose seed = scenes[i].pose;
    seed.rotation = ExpRotation({error, -error, error}) * seed.rotation;
    seed.translation.x() += 10.0 * error;
    State at;
    Refined refined;
    return problem.Start(seed, 0.0, problem.FirstReading(), &at).ok() &&
           problem.SolveGraduated(options.max_iterations, &at).ok() &&
           FillRefined(problem, at, &refined).ok();
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
  std::vector<Scene> scenes = Scenes(add);
  if (fitted) {
    for (Scene& scene : scenes) FitDirect(kNoisePx, &scene.observations);
  }
  RunInTurn(state, scenes,
            [&](std::size_t i) { return EstimatePose(scenes[i].observations).status.ok(); });
}

void BM_EstimatePoseCircleAndLines(benchmark::State& state) { Estimate(state, AddPaperLike, true); }
BENCHMARK(BM_EstimatePoseCircleAndLines);

void BM_EstimatePoseCircleAndLinesUnfitted(benchmark::State& state) {
  Estimate(state, AddPaperLike, false);
}
BENCHMARK(BM_EstimatePoseCircleAndLinesUnfitted);

// As a front end calls it: with the pose of the frame before.
void BM_EstimatePoseFromPrior(benchmark::State& state) {
  std::vector<Scene> scenes = Scenes(AddPaperLike);
  for (Scene& scene : scenes) FitDirect(kNoisePx, &scene.observations);
  RunInTurn(state, scenes, [&](std::size_t i) {
    EstimationOptions options;
    options.prior = scenes[i].pose;
    options.prior->rotation = ExpRotation({kWarm, -kWarm, kWarm}) * scenes[i].pose.rotation;
    return EstimatePose(scenes[i].observations, options).status.ok();
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
