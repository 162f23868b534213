// What the irregularity of a contour says of its shape.
#include "circline/estimators/exactness.h"

#include <gtest/gtest.h>

#include <cmath>

#include "circline/estimators/basics.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/random.h"
#include "tests/pinhole_camera.h"

namespace circline {
namespace {

// Half the rim of a disc, of points of 0.05 px noise that are off by a wave besides.
CircleObservation Rim(double radius_px, double wave_px, int num_points) {
  Random random(5);
  CircleObservation circle;
  for (int i = 0; i < num_points; ++i) {
    const double t = kPi * i / num_points;
    const double r = radius_px + wave_px * std::sin(9.0 * t) + 0.05 * random.Normal();
    circle.points.emplace_back(320.0 + r * std::cos(t), 240.0 + 0.7 * r * std::sin(t));
  }
  return circle;
}

double IrregularityOf(const CircleObservation& circle, const NoiseModel& noise) {
  Observations observations;
  observations.camera = PinholeCamera();
  observations.circles = {circle};
  FitDirect(0.05, &observations, nullptr, noise);
  return observations.circles[0].fit->irregularity;
}

TEST(Exactness, AnIrregularContourIsLessRound) {
  const NoiseModel noise;
  const double usual = IrregularityOf(Rim(20.0, 0.0, 30), noise);  // Too short to tell.
  EXPECT_NEAR(usual, 1.3, 0.2);
  EXPECT_LT(IrregularityOf(Rim(250.0, 0.0, 400), noise), 0.5 * usual);
  const double rough = IrregularityOf(Rim(250.0, 0.5, 400), noise);
  EXPECT_GT(rough, 1.5 * usual);
  EXPECT_LE(rough, 3.0);
  EXPECT_GT(rough, IrregularityOf(Rim(250.0, 0.2, 400), noise));
}

TEST(Exactness, BelievesAModelWithoutSpread) {
  NoiseModel noise;
  noise.spread = 0.0;
  EXPECT_EQ(IrregularityOf(Rim(250.0, 0.5, 400), noise), 1.0);
  EXPECT_EQ(IrregularityOf(Rim(250.0, 0.5, 400), NoiseModel::Exact()), 1.0);
}

}  // namespace
}  // namespace circline
