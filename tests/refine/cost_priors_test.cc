// What is known beside features, as cost functions: gradients against differences, and the frame in
// which a prior of a pose counts.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/pose.h"
#include "circline/refine/cost_functions.h"
#include "tests/refine/cost_function_checks.h"

namespace circline::cost_function_checks {
namespace {

void ExpectItsGradient(ceres::CostFunction* owned, const Blocks& blocks) {
  const std::unique_ptr<ceres::CostFunction> cost(owned);
  ExpectGradientByDifferences(*cost, blocks);
}

TEST(CostPriorsTest, WhatIsKnownBeside) {
  const Eigen::Vector3d a = Eigen::Vector3d(1.0, 0.1, 0.05).normalized(),
                        b = Eigen::Vector3d(-0.1, 1.0, 0.02).normalized();
  const auto sphere = std::make_shared<ceres::SphereManifold<3>>();
  Blocks directions;
  directions.Add({a.x(), a.y(), a.z()}, sphere);
  directions.Add({b.x(), b.y(), b.z()}, sphere);
  for (const double angle : {0.5 * kPi, 1.3, -1.8, 4.5}) {
    ExpectItsGradient(NewAngleCost(angle, 0.01), directions);
  }
  Blocks points;
  points.Add({0.1, 0.2});
  points.Add({1.3, -0.4});
  ExpectItsGradient(NewLengthCost(1.2, 0.01), points);
  Blocks direction;
  direction.Add({a.x(), a.y(), a.z()}, sphere);
  ExpectItsGradient(NewDirectionPrior(Eigen::Vector3d::UnitX(), 0.01), direction);
  ExpectItsGradient(NewInPlanePrior(Eigen::Vector3d::UnitZ(), 0.01), direction);
  Blocks radius;
  radius.Add({0.31});
  ExpectItsGradient(NewLogPrior(0.3, 0.001), radius);
  Blocks pose;
  pose.AddPose();
  Matrix6d covariance = 1e-4 * Matrix6d::Identity();
  covariance(0, 4) = covariance(4, 0) = 4e-5;
  ExpectItsGradient(NewPosePrior(kRotation, kTranslation, covariance), pose);
  EXPECT_EQ(NewPosePrior(kRotation, kTranslation, -covariance), nullptr);
  Blocks rotation;
  rotation.AddRotation();
  ExpectItsGradient(
      NewDirectionMeasurement(Eigen::Vector3d::UnitZ(), kRotation * Eigen::Vector3d::UnitZ(), 0.01),
      rotation);
}

// A pose prior's residual is delta of rotation = exp([delta]x) * mean.
TEST(CostPriorsTest, APosePriorCountsInTheCameraFrame) {
  Matrix6d covariance = Matrix6d::Identity();
  covariance.diagonal() << 0.01, 0.04, 0.09, 1.0, 4.0, 9.0;
  const std::unique_ptr<ceres::CostFunction> cost(
      NewPosePrior(kRotation, kTranslation, covariance));
  const Eigen::Quaterniond q(Eigen::Matrix3d(ExpRotation({0.05, 0.0, 0.0}) * kRotation));
  const double rotation[4] = {q.x(), q.y(), q.z(), q.w()};
  const double translation[3] = {kTranslation.x(), kTranslation.y() + 1.0, kTranslation.z()};
  const double* parameters[2] = {rotation, translation};
  double r[6];
  ASSERT_TRUE(cost->Evaluate(parameters, r, nullptr));
  EXPECT_NEAR(r[0], 0.5, 1e-9);
  EXPECT_NEAR(r[4], 0.5, 1e-9);
  EXPECT_NEAR(r[1], 0.0, 1e-9);
}

}  // namespace
}  // namespace circline::cost_function_checks
