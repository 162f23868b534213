#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/refine/joint/readings.h"

namespace circline {
namespace {

using Eigen::Vector3d;

constexpr double kSigma = 0.01;  // Of each component, radians.

PoseHypothesis Turned(double sigmas, double probability) {
  PoseHypothesis h;
  h.cam_from_world.rotation = ExpRotation(Vector3d(0.0, sigmas * kSigma, 0.0));
  h.cam_from_world.translation = Vector3d::UnitZ();
  h.cost = -std::log(probability);
  SetCovariance(kSigma * kSigma * Matrix6d::Identity(), &h);
  return h;
}

TEST(MergeHumps, ThoseWithinTheirWidthAreOne) {
  std::vector<PoseHypothesis> all = {Turned(0.0, 0.4), Turned(50.0, 0.38), Turned(2.0, 0.22)};
  MergeHumps(&all);
  ASSERT_EQ(all.size(), 2U);
  EXPECT_NEAR(all[0].probability, 0.62, 1e-12);
  EXPECT_NEAR(all[1].probability, 0.38, 1e-12);
  EXPECT_TRUE(all[0].cam_from_world.rotation.isIdentity(1e-12));
  // Variances, and what the second is off by, as often as it is the one.
  const double apart = 2.0 * kSigma;
  EXPECT_NEAR(all[0].Covariance()(1, 1), kSigma * kSigma + 0.22 / 0.62 * apart * apart, 1e-12);
  EXPECT_NEAR(all[0].Covariance()(0, 0), kSigma * kSigma, 1e-12);
  EXPECT_NEAR(all[1].Covariance()(1, 1), kSigma * kSigma, 1e-12);
}

TEST(MergeHumps, TheMostProbableTogetherComesFirst) {
  std::vector<PoseHypothesis> all = {Turned(50.0, 0.4), Turned(0.0, 0.35), Turned(1.0, 0.25)};
  MergeHumps(&all);
  ASSERT_EQ(all.size(), 2U);
  EXPECT_NEAR(all[0].probability, 0.6, 1e-12);
  EXPECT_TRUE(all[0].cam_from_world.rotation.isIdentity(1e-12));
}

// Of lines alone the translation is a convention, which a focal length moves.
TEST(MergeHumps, OneRidgeOfTheFocalLengthIsOne) {
  std::vector<PoseHypothesis> all = {Turned(0.0, 0.5), Turned(1.0, 0.5)};
  Matrix6d covariance = Matrix6d::Zero();
  covariance.topLeftCorner<3, 3>() = kSigma * kSigma * Eigen::Matrix3d::Identity();
  for (PoseHypothesis& h : all) SetCovariance(covariance, &h);
  all[0].focal_sigma = all[1].focal_sigma = 0.2;
  all[1].focal_scale = 1.3;
  all[1].cam_from_world.translation = Vector3d(0.3, 0.4, 0.8);
  std::vector<PoseHypothesis> far = all;
  MergeHumps(&all);
  ASSERT_EQ(all.size(), 1U);
  EXPECT_NEAR(all[0].focal_sigma, std::sqrt(0.04 + 0.5 * 0.09), 1e-12);
  EXPECT_NEAR(all[0].focal_covariance[1], 0.5 * 0.3 * kSigma, 1e-12);
  EXPECT_TRUE(all[0].Covariance().bottomRows<3>().isZero(0.0));
  far[1].focal_scale = 2.0;
  MergeHumps(&far);
  EXPECT_EQ(far.size(), 2U);
}

// What the one says is free, or is no variable, has no variance after either, though the other's
// free turn is about another axis.
TEST(MergeHumps, WhatIsFreeStaysSo) {
  std::vector<PoseHypothesis> all = {Turned(0.0, 0.6), Turned(1.0, 0.4)};
  for (PoseHypothesis& h : all) {
    const Vector3d normal = h.cam_from_world.rotation.col(2);
    h.cam_from_world.translation = h.cam_from_world.rotation * Vector3d(0.6, 0.0, 0.8);
    Matrix6d onto = Matrix6d::Identity();
    onto.topLeftCorner<3, 3>() -= normal * normal.transpose();
    const Vector3d t = h.cam_from_world.translation;
    onto.bottomRightCorner<3, 3>() -= t * t.transpose();
    h.free_directions = {{normal.x(), normal.y(), normal.z(), 0.0, 0.0, 0.0}};
    h.circles.resize(2);
    SetCovariance(kSigma * kSigma * onto, &h, 5);
    EXPECT_EQ(h.rank, 4);
  }
  MergeHumps(&all);
  ASSERT_EQ(all.size(), 1U);
  EXPECT_EQ(all[0].rank, 4);
  const Vector3d t = all[0].cam_from_world.translation;
  const Matrix6d covariance = all[0].Covariance();
  EXPECT_LT(std::abs(covariance(2, 2)), 1e-18);
  EXPECT_LT(std::abs(t.dot(covariance.bottomRightCorner<3, 3>() * t)), 1e-18);
  EXPECT_GT(covariance(1, 1), kSigma * kSigma);
}

// What rounding leaves where all is free, or is no variable, is no knowledge.
TEST(SetCovariance, RankIsThatOfWhatIsNotFree) {
  PoseHypothesis h;
  Matrix6d covariance = 1e-21 * Matrix6d::Identity();
  covariance(0, 0) = covariance(1, 1) = 6e-4;
  h.free_directions = {{0.0, 0.0, 1.0, 0.0, 0.0, 0.0},
                       {0.0, 0.0, 0.0, 1.0, 0.0, 0.0},
                       {0.0, 0.0, 0.0, 0.0, 1.0, 0.0}};
  SetCovariance(covariance, &h, 5);
  EXPECT_EQ(h.rank, 2);
}

// One circle has two poses, also where it is seen from ahead.
TEST(MergeHumps, TheTwoPosesOfACircleStay) {
  std::vector<PoseHypothesis> all = {Turned(0.0, 0.5), Turned(1.0, 0.5)};
  for (PoseHypothesis& h : all) h.free_directions = {{0.0, 0.0, 1.0, 0.0, 0.0, 0.0}};
  std::vector<PoseHypothesis> of_two_circles = all;
  MergeHumps(&all);
  EXPECT_EQ(all.size(), 2U);
  for (PoseHypothesis& h : of_two_circles) h.circles.resize(2);
  MergeHumps(&of_two_circles);
  EXPECT_EQ(of_two_circles.size(), 1U);
}

}  // namespace
}  // namespace circline
