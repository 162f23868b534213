#include "circline/ransac/detection/uncertain_direction.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/ransac/detection/detection_test_util.h"

namespace circline {
namespace {

using detection_test::AxisDeg;
using detection_test::kDegrees;
using Eigen::Matrix3d;
using Eigen::Vector3d;

UncertainDirection Make(const Vector3d& vector, double sigma_deg) {
  UncertainDirection direction;
  direction.vector = vector.normalized();
  const double sigma = sigma_deg / kDegrees;
  direction.covariance =
      sigma * sigma * (Matrix3d::Identity() - direction.vector * direction.vector.transpose());
  return direction;
}

Vector3d InXy(double deg) { return {std::cos(deg / kDegrees), std::sin(deg / kDegrees), 0.0}; }

TEST(UncertainDirection, WhatCanBeTheSameDependsOnHowWellItIsKnown) {
  const UncertainDirection sharp = Make(InXy(0.0), 0.1), blunt = Make(InXy(0.0), 1.5);
  EXPECT_TRUE(SamePlane(sharp, Make(-InXy(1.0), 0.1), 5.0));  // Without sense.
  EXPECT_FALSE(SamePlane(sharp, Make(InXy(3.0), 0.1), 5.0));
  EXPECT_TRUE(SamePlane(blunt, Make(InXy(3.0), 0.1), 5.0));
  EXPECT_FALSE(SamePlane(blunt, Make(InXy(3.0), 0.1), 2.0));
  EXPECT_NEAR(AngleBetweenDeg(sharp, Make(-InXy(3.0), 1.0)), 3.0, 1e-9);
  EXPECT_TRUE(InPlane(sharp, Make(InXy(89.0), 0.1), 5.0));
  EXPECT_FALSE(InPlane(sharp, Make(InXy(87.0), 0.1), 5.0));
  EXPECT_TRUE(InPlane(blunt, Make(InXy(87.0), 0.1), 5.0));
}

TEST(UncertainDirection, ARightAngleIsNeverFarFromOne) {
  const UncertainDirection sharp = Make(InXy(0.0), 0.1);
  EXPECT_TRUE(Rectangular(sharp, Make(InXy(93.0), 0.1)));
  EXPECT_FALSE(Rectangular(sharp, Make(InXy(95.0), 0.1)));
}

// Half of the pairs at right angles to 0.7 degrees, half at any angle: of those with odds about o,
// o / (1 + o) are at right angles.
TEST(UncertainDirection, TheOddsOfARightAngleAreThoseOfItsPrior) {
  Random random(3);
  const auto turn = [&random](double sigma_deg) { return sigma_deg * random.Normal() / kDegrees; };
  int counts[3] = {0, 0, 0}, right[3] = {0, 0, 0};
  for (int trial = 0; trial < 40000; ++trial) {
    const bool is_right = random.Uniform() < 0.5;
    const double sine = 2.0 * random.Uniform() - 1.0, sigma_deg = random.Uniform(0.1, 1.5);
    const double angle = (is_right ? turn(0.7) : std::asin(sine)) + turn(sigma_deg);
    const double odds =
        LogOddsOfRightAngle(Make(Vector3d::UnitX(), 0.0),
                            Make(Vector3d(std::sin(angle), std::cos(angle), 0.0), sigma_deg));
    if (odds < -1.5 || odds > 1.5) continue;
    const int bin = odds < -0.5 ? 0 : odds < 0.5 ? 1 : 2;
    ++counts[bin];
    right[bin] += is_right ? 1 : 0;
  }
  const double expected[3] = {1.0 / (1.0 + std::exp(1.0)), 0.5, 1.0 / (1.0 + std::exp(-1.0))};
  for (int bin = 0; bin < 3; ++bin) {
    const double n = counts[bin], share = right[bin] / n;
    const double sigma = std::sqrt(expected[bin] * (1.0 - expected[bin]) / n);
    EXPECT_NEAR(share, expected[bin], 4.0 * sigma + 0.02) << bin;  // And the width of a bin.
    EXPECT_GT(n, 150) << bin;
  }
}

TEST(UncertainDirection, TheSpannedNormalHasTheSpreadOfItsSamples) {
  const UncertainDirection a = Make(Vector3d(1.0, 0.2, 0.1), 0.3);
  const UncertainDirection b = Make(Vector3d(0.2, 0.9, -0.4), 0.6);
  UncertainDirection normal;
  ASSERT_TRUE(SpannedNormal(a, b, &normal));
  EXPECT_NEAR(normal.vector.dot(a.vector), 0.0, 1e-12);
  EXPECT_NEAR(normal.vector.dot(b.vector), 0.0, 1e-12);
  Random random(1);
  const auto moved = [&random](const UncertainDirection& d, double sigma_deg) {
    const Vector3d noise(random.Normal(), random.Normal(), random.Normal());
    return Vector3d(d.vector + sigma_deg / kDegrees * d.vector.cross(noise));
  };
  Matrix3d scatter = Matrix3d::Zero();
  constexpr int kSamples = 100000;
  for (int k = 0; k < kSamples; ++k) {
    const Vector3d d = moved(a, 0.3).cross(moved(b, 0.6)).normalized() - normal.vector;
    scatter += d * d.transpose() / kSamples;
  }
  EXPECT_LT((scatter - normal.covariance).norm(), 0.02 * scatter.norm());
  EXPECT_FALSE(SpannedNormal(a, Make(Vector3d(1.0, 0.3, 0.1), 0.1), &normal));
}

TEST(UncertainDirection, TheMeanFollowsTheSharper) {
  const UncertainDirection sharp = Make(InXy(0.0), 0.1), blunt = Make(InXy(2.0), 3.0);
  const UncertainDirection mean = MeanDirection(blunt, {&sharp, &blunt});
  EXPECT_LT(AxisDeg(mean.vector, sharp.vector), 0.1);
  const UncertainDirection both = MeanDirection(sharp, {&sharp, &sharp});
  EXPECT_LT(AxisDeg(both.vector, sharp.vector), 1e-9);
  EXPECT_LT(both.covariance.trace(), mean.covariance.trace());
}

}  // namespace
}  // namespace circline
