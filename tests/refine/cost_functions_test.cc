#include "circline/refine/cost_functions.h"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "circline/estimators/pose.h"
#include "circline/estimators/random.h"

namespace circline {
namespace {

// Largest difference between a cost function's Jacobian and central differences, relative to the
// largest entry of that block.
double JacobianError(const ceres::CostFunction& cost, std::vector<std::vector<double>> parameters) {
  const std::size_t rows = static_cast<std::size_t>(cost.num_residuals());
  std::vector<double*> pointers;
  std::vector<std::vector<double>> jacobians;
  std::vector<double*> jacobian_pointers;
  for (std::vector<double>& block : parameters) {
    pointers.push_back(block.data());
    jacobians.emplace_back(rows * block.size());
  }
  for (std::vector<double>& jacobian : jacobians) jacobian_pointers.push_back(jacobian.data());
  std::vector<double> residuals(rows), plus(rows), minus(rows);
  EXPECT_TRUE(cost.Evaluate(pointers.data(), residuals.data(), jacobian_pointers.data()));
  double worst = 0.0;
  for (std::size_t b = 0; b < parameters.size(); ++b) {
    double largest = 1e-12, error = 0.0;
    for (std::size_t k = 0; k < parameters[b].size(); ++k) {
      constexpr double kStep = 1e-6;
      const double value = parameters[b][k];
      parameters[b][k] = value + kStep;
      EXPECT_TRUE(cost.Evaluate(pointers.data(), plus.data(), nullptr));
      parameters[b][k] = value - kStep;
      EXPECT_TRUE(cost.Evaluate(pointers.data(), minus.data(), nullptr));
      parameters[b][k] = value;
      for (std::size_t i = 0; i < rows; ++i) {
        const double numeric = (plus[i] - minus[i]) / (2.0 * kStep);
        largest = std::max(largest, std::abs(numeric));
        error = std::max(error, std::abs(numeric - jacobians[b][i * parameters[b].size() + k]));
      }
    }
    worst = std::max(worst, error / largest);
  }
  return worst;
}

// Points about the middle of a distorted photo, a few pixels off any curve.
PointSet RandomPoints(LossType loss, Random* random) {
  Camera camera;
  camera.model = CameraModel::kOpenCV;
  camera.fx = 500.0;
  camera.fy = 520.0;
  camera.cx = 320.0;
  camera.cy = 240.0;
  camera.distortion = {-0.3, 0.1, 1e-3, -1e-3, 0.02};
  PointSet set;
  set.loss = loss;
  set.sigma_px = 3.0;
  while (set.points.size() < 20) {
    CalibratedPoint p;
    const double u = random->Uniform(0.0, 640.0), v = random->Uniform(0.0, 480.0);
    if (PixelToCalibrated(camera, {u, v}, &p)) set.points.push_back(p);
  }
  return set;
}

class CostFunctionsTest : public ::testing::TestWithParam<LossType> {
 protected:
  Random random_{3};
  PointSet set_ = RandomPoints(GetParam(), &random_);
  Eigen::Matrix3d base_ = ExpRotation({2.5, 0.3, -0.4});
  double stretch_ = 20.0;
  // Not at the centre of the chart: the right Jacobian takes part.
  std::vector<double> w_ = {0.1, -0.2, 0.3};
};

TEST_P(CostFunctionsTest, CircleJacobianMatchesDifferences) {
  for (double facing : {-1.0, 1.0}) {
    const CircleCost joined(&set_, &stretch_, base_, facing, false, 1.0);
    EXPECT_LT(JacobianError(joined, {w_, {0.2, -0.1, 0.4}}), 1e-6);
    const CircleCost split(&set_, &stretch_, base_, facing, true, 3.0);
    EXPECT_LT(JacobianError(split, {w_, {0.2, -0.1}, {0.13}}), 1e-6);
  }
}

TEST_P(CostFunctionsTest, LineJacobiansMatchDifferences) {
  using Kind = LineCost::Kind;
  for (double facing : {-1.0, 1.0}) {
    const auto error = [&](Kind kind, const std::vector<std::vector<double>>& blocks) {
      return JacobianError(
          LineCost(kind, &set_, &stretch_, base_, facing, Eigen::Vector3d(0.6, 0.0, 0.8)), blocks);
    };
    EXPECT_LT(error(Kind::kFixedDirection, {w_, {0.7}}), 1e-6);
    EXPECT_LT(error(Kind::kInPlane, {w_, {0.4}, {0.7}}), 1e-6);
    EXPECT_LT(error(Kind::kXAxis, {w_, {0.2, 0.3}}), 1e-6);
    EXPECT_LT(error(Kind::kYAxis, {w_, {0.2, 0.3}}), 1e-6);
    EXPECT_LT(error(Kind::kDiameter, {w_, {0.2, 0.3}, {1.1}}), 1e-6);
  }
}

INSTANTIATE_TEST_SUITE_P(Losses, CostFunctionsTest,
                         ::testing::Values(LossType::kTrivial, LossType::kHuber, LossType::kCauchy,
                                           LossType::kTukey, LossType::kGemanMcClure));

TEST(PointCostTest, JacobianMatchesDifferences) {
  CalibratedPoint p;
  p.x = {0.1, 0.2};
  p.x_from_pixel = {2e-3, 1e-4, -1e-4, 2.2e-3};
  // facing 1 and a rotation near the identity: the plane Z = 1 is in front of the camera.
  const double stretch = 20.0;
  for (LossType loss : {LossType::kTrivial, LossType::kCauchy, LossType::kTukey}) {
    const PointCost cost(p, 5.0, loss, &stretch, ExpRotation({0.1, 0.2, 0.3}), 1.0);
    EXPECT_LT(JacobianError(cost, {{0.1, -0.2, 0.1}, {0.3, -0.2}}), 1e-6);
  }
}

TEST(AngleCostTest, JacobianMatchesDifferencesAndSenseDoesNotMatter) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double both[2] = {nan, nan}, second[2] = {0.0, nan};
  EXPECT_LT(JacobianError(AngleCost(1.5, 0.01, both), {{0.1}, {1.7}}), 1e-6);
  const AngleCost cost(1.5, 0.01, second);
  EXPECT_LT(JacobianError(cost, {{1.7}}), 1e-6);
  for (double theta : {1.5, -1.5, 1.5 + 3.14159265358979, 1.5 - 3.14159265358979}) {
    const double* parameters[1] = {&theta};
    double residual;
    ASSERT_TRUE(cost.Evaluate(parameters, &residual, nullptr));
    EXPECT_NEAR(residual, 0.0, 1e-9);
  }
}

TEST(LengthCostTest, JacobianMatchesDifferences) {
  EXPECT_LT(JacobianError(LengthCost(2.0), {{0.1, 0.2}, {0.9, -0.4}, {0.7}}), 1e-6);
}

}  // namespace
}  // namespace circline
