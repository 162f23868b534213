#include "circline/ransac/detection/structure/plane_angles.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <array>
#include <cmath>

#include "circline/estimators/basics.h"
#include "circline/estimators/pose.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

const Matrix3d kPlane = ExpRotation(Vector3d(0.5, -0.6, 0.4));

// In a plane that is turned so, known to a tenth of a degree.
UncertainDirection At(double degrees, const Matrix3d& turned = kPlane) {
  UncertainDirection out;
  out.direction = turned * Vector3d(std::cos(degrees * kDegree), std::sin(degrees * kDegree), 0.0);
  out.covariance = std::pow(0.1 * kDegree, 2.0) *
                   (Matrix3d::Identity() - out.direction * out.direction.transpose());
  return out;
}

double OfHexagons(double second_deg, double third_deg, const CameraError& camera = CameraError()) {
  return AnglesInPlane(At(0.0), At(second_deg), At(third_deg), camera, kPi / 3.0, 2.0 * kPi / 3.0);
}

// Neither the order nor the sense of directions without one matters.
TEST(AnglesInPlane, AreThoseOfLines) {
  const double as_given = OfHexagons(60.0, 120.0);
  EXPECT_GT(as_given, 1000.0);
  for (const auto& [second, third] : {std::array{120.0, 60.0}, {-60.0, 60.0}, {240.0, 300.0}})
    EXPECT_NEAR(OfHexagons(second, third), as_given, 1e-6 * as_given) << second << " " << third;
  EXPECT_LT(OfHexagons(60.0, 110.0), 1e-6);
  EXPECT_LT(OfHexagons(90.0, 45.0), 1e-6);
}

// The mean of the ratio over directions that run any way is 1.
TEST(AnglesInPlane, AreARatioOfLikelihoods) {
  double sum = 0.0;
  constexpr double kStep = 0.25;  // Degrees.
  for (double second = 40.0; second < 140.0; second += kStep) {
    for (double third = 40.0; third < 140.0; third += kStep) sum += OfHexagons(second, third);
  }
  EXPECT_NEAR(sum * std::pow(kStep / 180.0, 2.0), 1.0, 0.01);
}

// As far as the principal point may turn them: less is known of the angles.
TEST(AnglesInPlane, AreKnownAsWellAsThePrincipalPoint) {
  const CameraError guessed{0.04, 0.0};
  EXPECT_LT(OfHexagons(60.0, 120.0, guessed), 0.5 * OfHexagons(60.0, 120.0));
  EXPECT_GT(OfHexagons(62.0, 122.0, guessed), OfHexagons(62.0, 122.0));
}

}  // namespace
}  // namespace circline
