// FitObservations where the focal length is a guess and the lens bends.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>

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
  for (const LineObservation& line : observations.pencils[0].lines) add(line);
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
