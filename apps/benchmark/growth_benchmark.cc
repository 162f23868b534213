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
#include "tests/basics.h"

namespace circline {
namespace {

// Powers of ten to `most`, with a fit of n log n.
template <std::int64_t most>
void UpTo(benchmark::internal::Benchmark* benchmark) {
  benchmark->RangeMultiplier(10)->Range(most / 1000, most)->Unit(benchmark::kMillisecond);
  benchmark->Complexity(benchmark::oNLogN);
}

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
    circle.points.push_back(
        Eigen::Vector2d(200.0 * std::cos(angle) + beside, 150.0 * std::sin(angle)) +
        Noise2(0.2, &random));
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
BENCHMARK(BM_GrowthContourPoints)->Apply(UpTo<100000>);

void ParseImages(const std::string& images, benchmark::State* state) {
  const std::string text =
      "cameras: [{id: \"k\", model: \"pinhole\", width: 640, height: 480, "
      "camera_matrix: [600, 0, 320, 0, 600, 240, 0, 0, 1]}]\nimages:\n" +
      images;
  for (auto _ : *state) {
    std::vector<apps::SceneImage> parsed;
    if (!apps::ParseScene("scene", text, "", {}, &parsed).ok()) std::abort();
    benchmark::DoNotOptimize(parsed);
  }
  state->SetComplexityN(state->range(0));
}

void BM_GrowthScenePencils(benchmark::State& state) {
  std::string image = "  - file: \"a.jpg\"\n    pencils:\n";
  for (std::int64_t i = 0; i < state.range(0); ++i)
    image += "      - {id: \"p" + std::to_string(i) + "\", segments: [10, 20, 30, 40]}\n";
  ParseImages(image, &state);
}
BENCHMARK(BM_GrowthScenePencils)->Apply(UpTo<100000>);

void BM_GrowthSceneEntries(benchmark::State& state) {
  std::string images;
  for (std::int64_t i = 0; i < state.range(0); ++i)
    images += "  - {file: \"a.jpg\", camera: \"k\"}\n";
  ParseImages(images, &state);
}
BENCHMARK(BM_GrowthSceneEntries)->Apply(UpTo<100000>);

constexpr double kSegmentNoisePx = 0.2;

// A segment of a pencil, 20 to 90 pixels long.
LineObservation SegmentTo(const Eigen::Vector2d& vanishing_point, Random* random) {
  Eigen::Vector2d from{random->Uniform(-300.0, 300.0), random->Uniform(-200.0, 200.0)};
  if ((vanishing_point - from).norm() < 200.0) from *= -1.0;
  const double length = random->Uniform(20.0, 90.0);
  const Eigen::Vector2d to = from + length * (vanishing_point - from).normalized();
  const auto noisy = [random](const Eigen::Vector2d& p) {
    return Eigen::Vector2d(p + Noise2(kSegmentNoisePx, random));
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

// A sheet four units wide, six away, seen 40 degrees off its normal.
class Sheet {
 public:
  explicit Sheet(double noise_px = kSegmentNoisePx) : noise_px_(noise_px) {
    Camera& camera = observations_.camera;
    camera.fx = camera.fy = 600.0;
    camera.cx = 320.0;
    camera.cy = 240.0;
  }

  // Perhaps with its centre and a diameter; perhaps turned out of the sheet by 11 to 34 degrees.
  void AddCircle(bool is_marked, bool leans = false) {
    const Eigen::Vector2d center = Anywhere();
    const double radius = random_.Uniform(0.05, 0.2);
    const double lean = leans ? random_.Uniform(0.2, 0.6) : 0.0;
    CircleObservation circle;
    circle.id = "c" + std::to_string(observations_.circles.size());
    circle.plane = "p";
    constexpr int kPoints = 24;
    for (int k = 0; k < kPoints; ++k) {
      const Eigen::Vector2d arm = radius * Along(2.0 * kPi * k / kPoints);
      const Eigen::Vector2d turned(std::cos(lean) * arm.x(), arm.y());
      circle.points.push_back(Pixel(center + turned, -std::sin(lean) * arm.x()));
    }
    if (is_marked) {
      circle.center = Pixel(center);
      const Eigen::Vector2d across = radius * Along(random_.Uniform(0.0, kPi));
      circle.diameters.push_back({Pixel(center - across), Pixel(center + across)});
    }
    observations_.circles.push_back(circle);
  }

  void AddPencil(double angle, int segments, PencilDirection direction) {
    PencilObservation pencil;
    pencil.id = "l" + std::to_string(observations_.pencils.size());
    pencil.plane = "p";
    pencil.direction = direction;
    for (int k = 0; k < segments; ++k) {
      const Eigen::Vector2d from = Anywhere();
      const double length = random_.Uniform(0.2, 1.0);
      pencil.lines.push_back({{Pixel(from), Pixel(from + length * Along(angle))}, {}, {}});
    }
    observations_.pencils.push_back(pencil);
  }
  // Of any direction, which is returned.
  double AddFreePencil() {
    const double angle = random_.Uniform(0.0, kPi);
    AddPencil(angle, 3, PencilDirection::kFree);
    return angle;
  }
  // Pencils of any directions, each at a known angle to the one before, those of a chain.
  void AddAngles(int chain) {
    double before = AddFreePencil();
    for (int k = 1; k < chain; ++k) {
      const double angle = AddFreePencil();
      const std::size_t last = observations_.pencils.size() - 1;
      observations_.known_angles.push_back(
          {{observations_.pencils[last - 1].id, observations_.pencils[last].id},
           angle - before,
           0.01});
      before = angle;
    }
  }

  void AddLength() {
    const Eigen::Vector2d a = Anywhere(), b = Anywhere();
    KnownLength length;
    length.points = {Pixel(a), Pixel(b)};
    length.plane = "p";
    length.value = (a - b).norm();
    observations_.known_lengths.push_back(length);
  }

  const Observations& observations() const { return observations_; }

 private:
  static Eigen::Vector2d Along(double angle) { return {std::cos(angle), std::sin(angle)}; }
  Eigen::Vector2d Anywhere() {
    const double x = random_.Uniform(-2.0, 2.0), y = random_.Uniform(-2.0, 2.0);
    return {x, y};
  }
  Eigen::Vector2d Pixel(const Eigen::Vector2d& at, double height = 0.0) {
    const Eigen::Vector3d ray =
        ExpRotation({0.7, 0.0, 0.0}) * Eigen::Vector3d(at.x(), at.y(), height) +
        Eigen::Vector3d(0.0, 0.0, 6.0);
    Eigen::Vector2d pixel;
    CameraToPixel(observations_.camera, ray, &pixel);
    return pixel + Noise2(noise_px_, &random_);
  }

  double noise_px_;
  Random random_{1};
  Observations observations_;
};

// Pencils of three segments, of any directions of the sheet.
void BM_GrowthFreePencils(benchmark::State& state) {
  Sheet sheet;
  for (std::int64_t i = 0; i < state.range(0); ++i) sheet.AddFreePencil();
  FitAndEstimate(sheet.observations(), &state);
}
BENCHMARK(BM_GrowthFreePencils)->Apply(UpTo<10000>);

// The same in pairs at known angles, or in chains of so many.
void BM_GrowthKnownAngles(benchmark::State& state) {
  Sheet sheet;
  const std::int64_t chain = state.range(1);
  for (std::int64_t i = 0; i < state.range(0) / chain; ++i)
    sheet.AddAngles(static_cast<int>(chain));
  FitAndEstimate(sheet.observations(), &state);
}
BENCHMARK(BM_GrowthKnownAngles)
    ->ArgNames({"pencils", "chain"})
    ->ArgsProduct({{100, 1000, 10000}, {2}})
    ->ArgsProduct({{100, 1000, 10000}, {100}})
    ->Unit(benchmark::kMillisecond);

// So many of every kind: circles with their centres and diameters, segments of two orthogonal
// pencils, pencils of any direction, lengths.
void BM_GrowthOfAll(benchmark::State& state) {
  const auto count = static_cast<int>(state.range(0));
  Sheet sheet;
  for (int i = 0; i < count; ++i) sheet.AddCircle(true);
  for (int i = 0; i < count; ++i) sheet.AddFreePencil();
  for (int i = 0; i < count; ++i) sheet.AddLength();
  sheet.AddPencil(0.0, count, PencilDirection::kX);
  sheet.AddPencil(0.5 * kPi, count, PencilDirection::kY);
  FitAndEstimate(sheet.observations(), &state);
}
BENCHMARK(BM_GrowthOfAll)->Apply(UpTo<10000>);

// Circles of one plane; where the second argument is above 0, each so-many-th one leans out of it.
void BM_EstimatePoseCirclesOfAPlane(benchmark::State& state) {
  constexpr double kNoisePx = 0.3;
  Sheet sheet(kNoisePx);
  for (std::int64_t i = 0; i < state.range(0); ++i) {
    sheet.AddCircle(false, state.range(1) > 0 && i % state.range(1) == 0);
  }
  Observations observations = sheet.observations();
  FitDirect(kNoisePx, &observations);
  for (auto _ : state) benchmark::DoNotOptimize(EstimatePose(observations));
}
BENCHMARK(BM_EstimatePoseCirclesOfAPlane)
    ->ArgNames({"circles", "leaning_every"})
    ->ArgsProduct({{10, 30, 100, 300, 1000}, {0, 5}})
    ->Args({10000, 0})
    ->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace circline
