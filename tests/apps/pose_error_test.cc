#include "apps/common/pose_error.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <vector>

#include "circline/estimators/basics.h"

namespace circline::apps {
namespace {

Eigen::Matrix3d Truth3() {
  return Eigen::AngleAxisd(0.84, Eigen::Vector3d(0.717, 0.359, 0.598).normalized())
      .toRotationMatrix();
}

// The truth off by two degrees about an axis of the camera frame.
Eigen::Matrix3d Disturbed(const Eigen::Matrix3d& truth) {
  return Eigen::AngleAxisd(2.0 * kDegree, Eigen::Vector3d(1.0, 2.0, -1.0).normalized()) * truth;
}

TEST(PoseError, GroupsHaveTheirOrderAndAreClosed) {
  EXPECT_EQ(SymmetryGroup(Symmetry::kNone).size(), 1U);
  EXPECT_EQ(SymmetryGroup(Symmetry::kD2).size(), 4U);
  EXPECT_EQ(SymmetryGroup(Symmetry::kD4).size(), 8U);
  for (const Symmetry symmetry : {Symmetry::kD2, Symmetry::kD4}) {
    const std::vector<Eigen::Matrix3d> group = SymmetryGroup(symmetry);
    for (const Eigen::Matrix3d& a : group) {
      EXPECT_NEAR(a.determinant(), 1.0, 1e-12);
      for (const Eigen::Matrix3d& b : group) {
        int found = 0;
        for (const Eigen::Matrix3d& c : group) found += (a * b - c).norm() < 1e-12 ? 1 : 0;
        EXPECT_EQ(found, 1);
      }
    }
  }
}

TEST(PoseError, IsTheMinimumOverTheGroup) {
  const Eigen::Matrix3d truth = Truth3();
  for (const Symmetry symmetry : {Symmetry::kNone, Symmetry::kD2, Symmetry::kD4}) {
    for (const Eigen::Matrix3d& s : SymmetryGroup(symmetry)) {
      EXPECT_NEAR(RotationErrorDeg(truth, Disturbed(truth) * s, symmetry), 2.0, 1e-9);
    }
  }
  const Eigen::Matrix3d flipped = truth * Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  EXPECT_NEAR(RotationErrorDeg(truth, flipped, Symmetry::kNone), 180.0, 1e-9);
  const Eigen::Matrix3d quarter =
      truth * Eigen::AngleAxisd(90.0 * kDegree, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  EXPECT_NEAR(RotationErrorDeg(truth, quarter, Symmetry::kD2), 90.0, 1e-9);
  EXPECT_NEAR(RotationErrorDeg(truth, quarter, Symmetry::kD4), 0.0, 1e-9);
}

TEST(PoseError, OfAnAxisIsThatOfTheNormalUpToSign) {
  const Eigen::Matrix3d truth = Truth3();
  const Eigen::Matrix3d turned =
      truth * Eigen::AngleAxisd(1.234, Eigen::Vector3d::UnitZ()).toRotationMatrix() *
      Eigen::AngleAxisd(3.0 * kDegree, Eigen::Vector3d::UnitX()).toRotationMatrix();
  EXPECT_NEAR(RotationErrorDeg(truth, turned, Symmetry::kAxis), 3.0, 1e-9);
  const Eigen::Matrix3d upside_down = turned * Eigen::Vector3d(-1.0, 1.0, -1.0).asDiagonal();
  EXPECT_NEAR(RotationErrorDeg(truth, upside_down, Symmetry::kAxis), 3.0, 1e-9);
}

TEST(PoseError, SmallAnglesAreExact) {
  const Eigen::Vector3d a = Eigen::Vector3d::UnitX(), b(1.0, 1e-9, 0.0);
  EXPECT_NEAR(AngleDeg(a, b), 1e-9 / kDegree, 1e-15);
  EXPECT_NEAR(AngleDeg(a, -b), 180.0, 1e-6);
  EXPECT_NEAR(AngleWithoutSenseDeg(a, -b), 1e-9 / kDegree, 1e-15);
}

class ComparePoseTest : public testing::Test {
 protected:
  ComparePoseTest() {
    Truth truth;
    truth.rotation = Truth3();
    truth.translation = Eigen::Vector3d(0.0, 0.0, 5.0);
    truth.directions = {{"L1", Eigen::Vector3d::UnitX()}};
    image_.truth = truth;
    hypothesis_.cam_from_world.rotation = Disturbed(*truth.rotation);
    hypothesis_.cam_from_world.translation = Eigen::Vector3d(0.0, 1.0, 1.0);
    hypothesis_.origin_observed = true;
    hypothesis_.pencils = {{"L1", Eigen::Vector3d(-1.0, 0.1, 0.0).normalized(), 0.1},
                           {"L2", Eigen::Vector3d(-1.0, 0.01, 0.0).normalized(), 0.1}};
  }
  SceneImage image_;
  PoseHypothesis hypothesis_;
};

TEST_F(ComparePoseTest, ComparesEverything) {
  const PoseErrors errors = ComparePose(hypothesis_, image_);
  EXPECT_NEAR(errors.rotation_deg.value(), 2.0, 1e-9);
  EXPECT_LE(errors.normal_deg.value(), 2.0 + 1e-9);
  EXPECT_NEAR(errors.translation_deg.value(), 45.0, 1e-9);
  ASSERT_EQ(errors.directions_deg.size(), 1U);
  EXPECT_EQ(errors.directions_deg[0].first, "L1");
  EXPECT_NEAR(errors.directions_deg[0].second, std::atan(0.1) / kDegree, 1e-9);
  EXPECT_EQ(errors.Headline(), errors.rotation_deg);
}

TEST_F(ComparePoseTest, DetectedPencilsAreFoundByDirection) {
  image_.detect_everything = true;
  const PoseErrors errors = ComparePose(hypothesis_, image_);
  EXPECT_NEAR(errors.directions_deg[0].second, std::atan(0.01) / kDegree, 1e-9);
  EXPECT_FALSE(errors.translation_deg.has_value());  // Nobody said which point the origin is.
  image_.observations.frame.origin = Eigen::Vector2d(1.0, 2.0);
  EXPECT_TRUE(ComparePose(hypothesis_, image_).translation_deg.has_value());
}

TEST_F(ComparePoseTest, OnlyTheNormalWhereARotationIsFree) {
  const Eigen::Vector3d normal = hypothesis_.cam_from_world.rotation.col(2);
  hypothesis_.free_directions = {{normal.x(), normal.y(), normal.z(), 0.0, 0.0, 0.0}};
  ASSERT_TRUE(hypothesis_.RotationIsFree());
  const PoseErrors errors = ComparePose(hypothesis_, image_);
  EXPECT_FALSE(errors.rotation_deg.has_value());
  EXPECT_EQ(errors.Headline(), errors.normal_deg);
}

TEST_F(ComparePoseTest, NoTranslationWithoutAnObservedOrigin) {
  hypothesis_.origin_observed = false;
  EXPECT_FALSE(ComparePose(hypothesis_, image_).translation_deg.has_value());
}

TEST_F(ComparePoseTest, NothingWithoutTruth) {
  image_.truth.reset();
  const PoseErrors errors = ComparePose(hypothesis_, image_);
  EXPECT_FALSE(errors.Headline().has_value());
  EXPECT_TRUE(errors.directions_deg.empty());
}

}  // namespace
}  // namespace circline::apps
