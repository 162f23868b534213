#include "circline/estimators/circle_pose.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/random.h"
#include "circline/estimators/statistics.h"

namespace circline {
namespace {

// A circle of radius 1 tilted from the direction to the camera by `tilt`, in a random direction.
CirclePose RandomCircle(double tilt, double distance, Random* random) {
  CirclePose pose;
  pose.center =
      distance *
      Eigen::Vector3d{random->Uniform(-0.5, 0.5), random->Uniform(-0.5, 0.5), 1.0}.normalized();
  const Eigen::Vector3d towards = -pose.center.normalized();
  const Eigen::Vector3d a = towards.unitOrthogonal(), b = towards.cross(a);
  const double spin = random->Uniform(0.0, 2.0 * kPi);
  pose.normal =
      std::cos(tilt) * towards + std::sin(tilt) * (std::cos(spin) * a + std::sin(spin) * b);
  return pose;
}

double BestNormalError(const CirclePose& truth) {
  std::array<CirclePose, 2> poses;
  const int count = CirclePoses(ProjectCircle(truth), &poses);
  double best = 4.0;
  for (int i = 0; i < count; ++i) {
    const CirclePose& p = poses[static_cast<std::size_t>(i)];
    best = std::min(
        best, p.normal.cross(truth.normal).norm() + (p.normal.dot(truth.normal) < 0.0 ? 4.0 : 0.0));
  }
  return best;
}

TEST(CirclePoseTest, TruthIsAmongTheTwo) {
  Random random(1);
  std::vector<double> errors;
  for (int i = 0; i < 100000; ++i) {
    const double tilt = random.Uniform(0.02, 1.45), distance = random.Uniform(2.0, 40.0);
    const CirclePose truth = RandomCircle(tilt, distance, &random);
    // Circles that reach behind the camera's plane have no ellipse as image.
    if (truth.center.z() < 1.5) continue;
    errors.push_back(BestNormalError(truth));
  }
  ASSERT_GT(errors.size(), 90000U);
  EXPECT_LT(Median(errors), 1e-12);
  EXPECT_LT(*std::max_element(errors.begin(), errors.end()), 1e-6);
}

TEST(CirclePoseTest, ACircleIsInViewWhereAllOfItsPointsAre) {
  Random random(6);
  int seen = 0;
  for (int i = 0; i < 2000; ++i) {
    const double tilt = random.Uniform(0.0, 1.5), distance = random.Uniform(0.1, 2.0);
    const CirclePose pose = RandomCircle(tilt, distance, &random);
    const Eigen::Vector3d a = pose.normal.unitOrthogonal(), b = pose.normal.cross(a);
    double nearest = pose.center.z();
    for (int k = 0; k < 3600; ++k) {
      const double t = k * kPi / 1800.0;
      nearest = std::min(nearest, (pose.center + std::cos(t) * a + std::sin(t) * b).z());
    }
    if (std::abs(nearest) < 1e-6) continue;  // As far as 3600 points tell.
    EXPECT_EQ(IsInView(pose), nearest > 0.0);
    seen += IsInView(pose) ? 1 : 0;
  }
  EXPECT_GT(seen, 500);
  EXPECT_LT(seen, 1500);
  EXPECT_FALSE(IsInView({-Eigen::Vector3d::UnitZ(), {0.0, 0.0, -5.0}}));
  EXPECT_TRUE(IsInView({{0.0, 0.0, -3.0}, {0.0, 0.0, 5.0}}));
  EXPECT_FALSE(IsInView({Eigen::Vector3d::UnitX(), {0.0, 0.0, 5.0}}));  // Seen edge-on.
  EXPECT_FALSE(IsInView({Eigen::Vector3d::Zero(), {0.0, 0.0, 5.0}}));
}

TEST(CirclePoseTest, CentersAreInUnitsOfTheRadius) {
  Random random(2);
  for (int i = 0; i < 1000; ++i) {
    const CirclePose truth = RandomCircle(0.7, 8.0, &random);
    std::array<CirclePose, 2> poses;
    ASSERT_EQ(CirclePoses(ProjectCircle(truth), &poses), 2);
    const double miss =
        std::min((poses[0].center - truth.center).norm(), (poses[1].center - truth.center).norm());
    EXPECT_LT(miss, 1e-10);
    for (const CirclePose& p : poses) {
      EXPECT_LT(p.normal.dot(p.center), 0.0);  // Faces the camera.
      // Both project to the very same conic.
      EXPECT_LT((ProjectCircle(p) - ProjectCircle(truth)).norm(), 1e-12);
    }
  }
}

TEST(CirclePoseTest, NearlyFrontalCirclesKeepTheirNormal) {
  Random random(3);
  for (double tilt = 1e-1; tilt > 0.5e-8; tilt *= 0.1) {
    const double bar = std::min(1e-7, std::max(1e-12, 1e-15 / tilt));
    // From wide ones, which fill the view, to those of a hundredth of a milliradian.
    for (double distance : {1.6, 3.0, 8.0, 100.0, 1e5}) {
      double worst = 0.0;
      for (int i = 0; i < 1000; ++i)
        worst = std::max(worst, BestNormalError(RandomCircle(tilt, distance, &random)));
      EXPECT_LE(worst, bar) << "tilt " << tilt << ", distance " << distance;
    }
  }
  // On the optical axis, to the last bit.
  for (double tilt = 1e-1; tilt > 0.5e-8; tilt *= 0.1) {
    const CirclePose truth = {{std::sin(tilt), 0.0, -std::cos(tilt)}, {0.0, 0.0, 8.0}};
    EXPECT_LE(BestNormalError(truth), std::min(1e-7, std::max(1e-12, 1e-15 / tilt)));
  }
  // Exactly frontal and on the axis: one pose.
  std::array<CirclePose, 2> poses;
  const Eigen::Matrix3d frontal = Eigen::Vector3d(1.0, 1.0, -0.01).asDiagonal();
  ASSERT_EQ(CirclePoses(frontal, &poses), 1);
  EXPECT_LT((poses[0].normal - Eigen::Vector3d(0.0, 0.0, -1.0)).norm(), 1e-12);
  EXPECT_LT((poses[0].center - Eigen::Vector3d(0.0, 0.0, 10.0)).norm(), 1e-9);
}

TEST(CirclePoseTest, WhatIsNoEllipseHasNoPose) {
  std::array<CirclePose, 2> poses;
  for (const Eigen::Vector3d& d :
       {Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(1, -1, -1), Eigen::Vector3d(1, 0, -1),
        Eigen::Vector3d(1, 1, 0), Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(NAN, 1, -1)}) {
    EXPECT_EQ(CirclePoses(Eigen::Matrix3d(d.asDiagonal()), &poses), 0) << d.transpose();
  }
}

}  // namespace
}  // namespace circline
