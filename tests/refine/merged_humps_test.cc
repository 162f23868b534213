#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/refine/readings.h"

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

// One circle has two poses, also where it is seen from ahead.
TEST(MergeHumps, TheTwoPosesOfACircleStay) {
  std::vector<PoseHypothesis> all = {Turned(0.0, 0.5), Turned(1.0, 0.5)};
  for (PoseHypothesis& h : all) h.free_directions = {{0.0, 0.0, 1.0, 0.0, 0.0, 0.0}};
  MergeHumps(&all);
  EXPECT_EQ(all.size(), 2U);
}

}  // namespace
}  // namespace circline
