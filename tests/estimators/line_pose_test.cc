#include "circline/estimators/line_pose.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <limits>

namespace circline {
namespace {

const Eigen::Vector3d kX(0.8, 0.1, 0.59), kY(-0.1, 0.9, 0.1);

TEST(LinePoseTest, DirectionsGiveAProperRotation) {
  Eigen::Matrix3d R;
  ASSERT_TRUE(RotationFromDirections(2.0 * kX, 5.0 * kY, &R));
  EXPECT_NEAR(R.determinant(), 1.0, 1e-14);
  EXPECT_LT((R.col(0) - kX.normalized()).norm(), 1e-14);
  EXPECT_NEAR(R.col(2).dot(kX), 0.0, 1e-14);
  EXPECT_NEAR(R.col(2).dot(kY), 0.0, 1e-14);
  EXPECT_GT(R.col(1).dot(kY), 0.0);
}

TEST(LinePoseTest, VarianceDecidesWhoTurns) {
  Eigen::Matrix3d R;
  // A perfect X keeps its direction; a perfect Y keeps its own; equal ones share.
  ASSERT_TRUE(RotationFromOrthogonalDirections(kX, 0.0, kY, 1.0, &R));
  EXPECT_LT((R.col(0) - kX.normalized()).norm(), 1e-12);
  ASSERT_TRUE(RotationFromOrthogonalDirections(kX, 1.0, kY, 0.0, &R));
  EXPECT_LT((R.col(1) - kY.normalized()).norm(), 1e-12);
  ASSERT_TRUE(RotationFromOrthogonalDirections(kX, 1.0, kY, 1.0, &R));
  EXPECT_NEAR(R.col(0).dot(kX.normalized()), R.col(1).dot(kY.normalized()), 1e-12);
  EXPECT_NEAR(R.determinant(), 1.0, 1e-14);
}

TEST(LinePoseTest, RefusesCoincidingAndBrokenDirections) {
  Eigen::Matrix3d R;
  EXPECT_FALSE(RotationFromDirections(kX, -2.0 * kX, &R));
  EXPECT_FALSE(RotationFromDirections(kX, Eigen::Vector3d::Zero(), &R));
  EXPECT_FALSE(RotationFromDirections(
      kX, Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN()), &R));
  EXPECT_FALSE(RotationFromOrthogonalDirections(kX, 1.0, kX, 1.0, &R));
}

TEST(LinePoseTest, FourSignChoicesAreRightHandedAndDiffer) {
  Eigen::Matrix3d R;
  ASSERT_TRUE(RotationFromDirections(kX, kY, &R));
  const auto choices = SignChoices(R);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(choices[i].determinant(), 1.0, 1e-12);
    for (std::size_t j = 0; j < i; ++j) EXPECT_GT((choices[i] - choices[j]).norm(), 1.0);
  }
}

TEST(LinePoseTest, MovesAlongFollowsTheImage) {
  // A tilted plane; a point and the same moved along a direction of the plane.
  Eigen::Matrix3d R;
  ASSERT_TRUE(RotationFromDirections(kX, kY, &R));
  const Eigen::Vector3d origin(0.3, -0.2, 5.0);
  const Eigen::Vector3d moved = origin + 0.7 * R.col(0);
  const Eigen::Vector3d x0 = origin / origin.z(), x1 = moved / moved.z();
  for (double sign : {1.0, -1.0}) {
    EXPECT_TRUE(MovesAlong(R.col(0), sign * R.col(2), x0, x1));
    EXPECT_FALSE(MovesAlong(-R.col(0), sign * R.col(2), x0, x1));
  }
}

}  // namespace
}  // namespace circline
