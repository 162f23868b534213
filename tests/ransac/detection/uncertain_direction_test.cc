#include "circline/ransac/detection/structure/uncertain_direction.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/conic_fit.h"
#include "tests/basics.h"
#include "tests/ransac/detection/detection_test_util.h"

namespace circline {
namespace {

using detection_test::AxisDeg;
using Eigen::Matrix3d;
using Eigen::Vector3d;

UncertainDirection Make(const Vector3d& vector, double sigma_deg) {
  UncertainDirection direction;
  direction.direction = vector.normalized();
  const double sigma = sigma_deg * kDegree;
  direction.covariance =
      sigma * sigma *
      (Matrix3d::Identity() - direction.direction * direction.direction.transpose());
  return direction;
}

Vector3d InXy(double deg) { return {std::cos(deg * kDegree), std::sin(deg * kDegree), 0.0}; }

TEST(UncertainDirection, WhatLiesInAPlaneDependsOnHowWellItIsKnown) {
  const UncertainDirection sharp = Make(InXy(0.0), 0.1), blunt = Make(InXy(0.0), 1.5);
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
  const auto turn = [&random](double sigma_deg) { return sigma_deg * random.Normal() * kDegree; };
  int counts[3] = {0, 0, 0}, right[3] = {0, 0, 0};
  for (int trial = 0; trial < 40000; ++trial) {
    const bool is_right = random.Uniform() < 0.5;
    const double sine = 2.0 * random.Uniform() - 1.0, sigma_deg = random.Uniform(0.1, 1.5);
    const double truth = is_right ? turn(0.7) : std::asin(sine);
    const double angle = truth + turn(sigma_deg);
    const double odds = RightAngle(Make(Vector3d::UnitX(), 0.0),
                                   Make(Vector3d(std::sin(angle), std::cos(angle), 0.0), sigma_deg))
                            .LogOdds();
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
  EXPECT_NEAR(normal.direction.dot(a.direction), 0.0, 1e-12);
  EXPECT_NEAR(normal.direction.dot(b.direction), 0.0, 1e-12);
  Random random(1);
  const auto moved = [&random](const UncertainDirection& d, double sigma_deg) {
    const Vector3d noise = Noise3(sigma_deg * kDegree, &random);
    return Vector3d(d.direction + d.direction.cross(noise));
  };
  Matrix3d scatter = Matrix3d::Zero();
  constexpr int kSamples = 100000;
  for (int k = 0; k < kSamples; ++k) {
    const Vector3d a_moved = moved(a, 0.3), b_moved = moved(b, 0.6);
    const Vector3d d = a_moved.cross(b_moved).normalized() - normal.direction;
    scatter += d * d.transpose() / kSamples;
  }
  EXPECT_LT((scatter - normal.covariance).norm(), 0.02 * scatter.norm());
  EXPECT_FALSE(SpannedNormal(a, Make(Vector3d(1.0, 0.3, 0.1), 0.1), &normal));
}

Vector3d DrawNormal(double tilt_deg, Random* random) {
  const double turn = random->Uniform(0.0, 2.0 * kPi), tilt = tilt_deg * kDegree;
  return {std::sin(tilt) * std::cos(turn), std::sin(tilt) * std::sin(turn), -std::cos(tilt)};
}

// A disc of 12 pixels' radius anywhere in the photo, from 40 points with noise of 0.1 pixels.
ConicFit SmallDisc(const Vector3d& normal, Random* random) {
  const Vector3d center{random->Uniform(-20.0, 20.0), random->Uniform(-15.0, 15.0), 66.0};
  const Camera camera = detection_test::TestCamera(640, 480, 800.0);
  const Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
  std::vector<CalibratedPoint> points;
  for (int k = 0; k < 40; ++k) {
    const double angle = k * kPi / 20.0;
    Eigen::Vector2d pixel;
    CalibratedPoint point;
    EXPECT_TRUE(CameraToPixel(camera, center + std::cos(angle) * u + std::sin(angle) * v, &pixel));
    pixel += Noise2(0.1, random);
    EXPECT_TRUE(PixelToCalibrated(camera, pixel, &point));
    points.push_back(point);
  }
  ConicFit fit;
  EXPECT_TRUE(FitConic(points, 0.1, &fit).ok());
  return fit;
}

// Where a disc is frontal its two normals meet, and neither is Gaussian.
TEST(UncertainDirection, ADiscLiesInItsPlaneHoweverFrontal) {
  constexpr int kTrials = 1000;
  for (const double tilt_deg : {0.0, 1.0, 3.0, 10.0, 40.0}) {
    Random random(7);
    int in_own = 0, in_other = 0;
    for (int trial = 0; trial < kTrials; ++trial) {
      const Vector3d normal = DrawNormal(tilt_deg, &random);
      const ConicFit disc = SmallDisc(normal, &random);
      in_own += CanLieIn(disc, Make(normal, 0.0)) ? 1 : 0;
      const Vector3d other = normal + 0.6 * DrawNormal(90.0, &random);
      in_other += CanLieIn(disc, Make(other, 0.0)) ? 1 : 0;
    }
    // Of two degrees of freedom 1.1 % are beyond three deviations.
    EXPECT_GE(in_own, 0.98 * kTrials) << tilt_deg;
    // Now and then the other one is the second plane that shows the same ellipse.
    EXPECT_LE(in_other, 0.1 * kTrials) << tilt_deg;
  }
}

TEST(UncertainDirection, DiscsTellTheirPlaneAsWellAsTheyState) {
  for (const double tilt_deg : {3.0, 30.0}) {
    Random random(8);
    double nees = 0.0;
    constexpr int kTrials = 400;
    for (int trial = 0; trial < kTrials; ++trial) {
      const Vector3d normal = DrawNormal(tilt_deg, &random);
      std::vector<ConicFit> discs(12);
      std::vector<const ConicFit*> all;
      for (ConicFit& disc : discs) {
        disc = SmallDisc(normal, &random);
        all.push_back(&disc);
      }
      const UncertainDirection found =
          NormalOfCircles(Make(normal + 0.05 * DrawNormal(90.0, &random), 0.0), 30.0, all);
      const Vector3d u = found.direction.unitOrthogonal(), v = found.direction.cross(u);
      Eigen::Matrix<double, 3, 2> basis;
      basis << u, v;
      const Eigen::Vector2d error = basis.transpose() * normal;
      nees += error.dot((basis.transpose() * found.covariance * basis).inverse() * error) / kTrials;
    }
    // Expected 2, with a deviation of 0.1; less, as the model's own error is stated beside the
    // noise.
    EXPECT_LT(nees, 2.4) << tilt_deg;
    EXPECT_GT(nees, 0.5) << tilt_deg;
  }
}

TEST(CircleNormals, BothAndTheirSpread) {
  const Vector3d normal = Vector3d(0.3, 0.5, -1.0).normalized();
  ConicFit fit = detection_test::FitOfCircle(normal, Vector3d(0.5, 0.2, 6.0), 1e-10);
  std::array<UncertainDirection, 2> normals, worse;
  ASSERT_EQ(CircleNormals(fit, &normals), 2);
  EXPECT_LT(std::min(AxisDeg(normals[0].direction, normal), AxisDeg(normals[1].direction, normal)),
            1e-6);
  for (const UncertainDirection& n : normals) {
    EXPECT_GT(n.covariance.trace(), 0.0);
    EXPECT_NEAR(n.direction.dot(n.covariance * n.direction), 0.0, 0.01 * n.covariance.trace());
  }
  fit.ScaleCovariance(4.0);
  CircleNormals(fit, &worse);
  EXPECT_NEAR(worse[0].covariance.trace(), 4.0 * normals[0].covariance.trace(),
              1e-3 * worse[0].covariance.trace());
}

}  // namespace
}  // namespace circline
