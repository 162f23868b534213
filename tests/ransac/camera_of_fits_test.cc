// FitObservations where the focal length or the lens is a guess.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>

#include "circline/ransac/fit_observations.h"
#include "tests/plane_scene.h"

namespace circline {
namespace {

FitOptions FocalSigma(double log_focal) {
  FitOptions options;
  options.noise_model = NoiseModel::Exact();
  options.noise_model.camera.log_focal = log_focal;
  return options;
}

// Two circles and four long lines, seen by a lens of short focal length.
Observations SeenThrough(CameraModel model, std::uint64_t seed) {
  PlaneScene scene(0.6, 0.5, seed);
  scene.camera.model = model;
  scene.camera.fx = scene.camera.fy = model == CameraModel::kFisheye ? 250.0 : 420.0;
  scene.camera.distortion = {};
  if (model == CameraModel::kOpenCV) scene.camera.distortion[0] = -0.25;
  Observations observations;
  observations.camera = scene.camera;
  observations.circles = {scene.Circle("large", 0.0, 0.0, 4.5, 120),
                          scene.Circle("small", 2.0, 1.5, 1.5, 60)};
  observations.pencils.emplace_back();
  observations.pencils[0].id = "along";
  observations.pencils[0].sigma_px = 0.5;
  for (const double y : {-4.0, -2.0, 2.0, 4.0})
    observations.pencils[0].lines.push_back(scene.Line({-4.0, y, 0.0}, {4.0, y, 0.0}, 60));
  return observations;
}

void Guess(double factor, Observations* observations) {
  observations->camera.fx *= factor;
  observations->camera.fy *= factor;
}

double ShareOfInliers(const Observations& observations) {
  std::ptrdiff_t inliers = 0, all = 0;
  const auto add = [&](const auto& feature) {
    inliers += std::count(feature.inliers.begin(), feature.inliers.end(), 1);
    all += static_cast<std::ptrdiff_t>(feature.points.size());
  };
  for (const CircleObservation& circle : observations.circles) add(circle);
  for (const PencilObservation& pencil : observations.pencils) {
    for (const LineObservation& line : pencil.lines) add(line);
  }
  return static_cast<double>(inliers) / static_cast<double>(all);
}

class GuessedFocalOfFits : public testing::TestWithParam<CameraModel> {};

TEST_P(GuessedFocalOfFits, LeavesNoPointsOut) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Observations truth = SeenThrough(GetParam(), seed);
    for (const double factor : {0.5, 0.7, 1.4, 2.0}) {
      Observations observations = truth;
      Guess(factor, &observations);
      const double given = observations.camera.fx;
      ASSERT_TRUE(FitObservations(FocalSigma(0.7), &observations).ok());
      EXPECT_GE(ShareOfInliers(observations), 0.98) << factor << ", seed " << seed;
      EXPECT_NEAR(std::log(observations.camera.fx / truth.camera.fx), 0.0, 0.06)
          << factor << ", seed " << seed;
      EXPECT_EQ(observations.stated_focal_px, given);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Lenses, GuessedFocalOfFits,
                         testing::Values(CameraModel::kOpenCV, CameraModel::kFisheye));

// Up to just before the edge of what the lens sees, where 1 % of the focal length is many standard
// deviations.
TEST(FocalOfFits, LeavesNoPointsOutAtTheEdgeOfAStrongLens) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    PlaneScene scene(0.3, 0.5, seed);
    scene.camera.fx = scene.camera.fy = 365.0;
    scene.camera.distortion = {-0.45, 0.25, 5e-4, 5e-4, -0.06};
    Observations truth = scene.Empty();
    truth.circles = {scene.Circle("c", 8.2, 1.0, 3.6, 120)};
    for (const double factor : {0.5, 0.7, 1.4, 2.0}) {
      Observations observations = truth;
      Guess(factor, &observations);
      ASSERT_TRUE(FitObservations(FocalSigma(1.0), &observations).ok());
      EXPECT_GE(ShareOfInliers(observations), 0.99) << factor << ", seed " << seed;
      EXPECT_NEAR(std::log(observations.camera.fx / truth.camera.fx), 0.0, 0.005)
          << factor << ", seed " << seed;
    }
  }
}

TEST(FocalOfFits, StaysWhereItIsKnownOrTellsNothing) {
  const auto stays = [](const FitOptions& options, Observations observations) {
    Guess(0.7, &observations);
    const double given = observations.camera.fx;
    EXPECT_TRUE(FitObservations(options, &observations).ok());
    return observations.camera.fx == given && observations.stated_focal_px == 0.0;
  };
  const Observations bent = SeenThrough(CameraModel::kOpenCV, 1);
  EXPECT_TRUE(stays(FocalSigma(0.002), bent));
  FitOptions open_lens = FocalSigma(0.7);
  open_lens.noise_model.camera.k1 = 0.3;
  EXPECT_TRUE(stays(open_lens, bent));
  EXPECT_TRUE(stays(FocalSigma(0.7), SeenThrough(CameraModel::kPinhole, 1)));
}

FitOptions LensSigma(double k1) {
  FitOptions options = FocalSigma(0.002);
  options.noise_model.camera.k1 = k1;
  return options;
}

// Two circles and eight long lines along two directions, through a lens of this k1.
Observations BentBy(double k1, std::uint64_t seed, int points_of_line = 40) {
  PlaneScene scene(0.6, 0.3, seed);
  scene.pose.translation.z() = 6.0;
  scene.camera.distortion = {k1};
  Observations observations = scene.Empty();
  observations.circles = {scene.Circle("large", 0.0, 0.0, 1.8, 120),
                          scene.Circle("small", 1.2, 0.8, 0.7, 60)};
  observations.pencils = scene.Axes(4, points_of_line);
  return observations;
}

// Other points up to 40 px away, one in ten, and no order among the points of a line.
void Disturb(std::uint64_t seed, Observations* observations) {
  Random random(seed);
  for (PencilObservation& pencil : observations->pencils) {
    for (LineObservation& line : pencil.lines) {
      for (std::size_t i = 0; i + 1 < line.points.size(); ++i) {
        const int others = static_cast<int>(line.points.size() - i);
        std::swap(line.points[i],
                  line.points[i + static_cast<std::size_t>(random.UniformInt(others))]);
        if (i % 10 == 3)
          line.points[i] +=
              Eigen::Vector2d{random.Uniform(-40.0, 40.0), random.Uniform(-40.0, 40.0)};
      }
    }
  }
}

// Lines alone, circles alone, both.
TEST(LensOfFits, LeavesNoPointsOut) {
  for (const double k1 : {-0.4, -0.15, 0.1}) {
    for (std::uint64_t seed = 1; seed <= 5; ++seed) {
      for (const char* kind : {"both", "lines", "circles", "disturbed"}) {
        Observations observations = BentBy(k1, seed);
        if (kind[0] == 'l') observations.circles.clear();
        if (kind[0] == 'c') observations.pencils.clear();
        if (kind[0] == 'd') Disturb(seed, &observations);
        observations.camera.distortion[0] = 0.02;
        ASSERT_TRUE(FitObservations(LensSigma(0.3), &observations).ok());
        const double found = observations.camera.distortion[0];
        EXPECT_GE(ShareOfInliers(observations), kind[0] == 'd' ? 0.92 : 0.985)
            << kind << ", k1 " << k1 << ", seed " << seed;
        // Circles are nearly ellipses through many a lens.
        if (kind[0] != 'c') {
          EXPECT_NEAR(found, k1, 0.03) << kind << ", k1 " << k1 << ", seed " << seed;
        }
        EXPECT_NEAR(observations.found_k1, found - 0.02, 1e-12);
        EXPECT_EQ(observations.stated_focal_px, 0.0);
      }
    }
  }
}

TEST(LensOfFits, StaysWhereItIsKnownOrTellsNothing) {
  const auto stays = [](const FitOptions& options, Observations observations) {
    const Camera given = observations.camera;
    EXPECT_TRUE(FitObservations(options, &observations).ok());
    return observations.camera.distortion == given.distortion && observations.found_k1 == 0.0;
  };
  Observations bent = BentBy(-0.3, 1);
  bent.camera.distortion[0] = 0.0;
  EXPECT_FALSE(stays(LensSigma(0.3), bent));
  EXPECT_TRUE(stays(LensSigma(0.0), bent));
  EXPECT_TRUE(stays(LensSigma(0.001), bent));
  EXPECT_TRUE(stays(LensSigma(0.3), BentBy(-0.3, 1)));
  Observations pinhole = bent;
  pinhole.camera.model = CameraModel::kPinhole;
  EXPECT_TRUE(stays(LensSigma(0.3), pinhole));
  Observations segments = BentBy(-0.3, 1, 2);
  segments.circles.clear();
  segments.camera.distortion[0] = 0.0;
  EXPECT_TRUE(stays(LensSigma(0.3), segments));
}

// A second fit takes the lens that the first has found for what it is.
TEST(LensOfFits, IsFoundOnce) {
  Observations observations = BentBy(-0.3, 1);
  observations.camera.distortion[0] = 0.0;
  ASSERT_TRUE(FitObservations(LensSigma(0.3), &observations).ok());
  const double found = observations.found_k1;
  EXPECT_NEAR(found, -0.3, 0.03);
  ASSERT_TRUE(FitObservations(LensSigma(0.3), &observations).ok());
  EXPECT_EQ(observations.found_k1, found);
  EXPECT_EQ(observations.camera.distortion[0], found);
}

TEST(FocalOfFits, ARightGuessStays) {
  for (const CameraModel model : {CameraModel::kOpenCV, CameraModel::kFisheye}) {
    Observations observations = SeenThrough(model, 1);
    const double given = observations.camera.fx;
    ASSERT_TRUE(FitObservations(FocalSigma(0.7), &observations).ok());
    EXPECT_NEAR(std::log(observations.camera.fx / given), 0.0, 0.06);
    EXPECT_GE(ShareOfInliers(observations), 0.98);
  }
}

}  // namespace
}  // namespace circline
