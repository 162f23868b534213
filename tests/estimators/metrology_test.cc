#include "circline/estimators/metrology.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/circle_pose.h"
#include "circline/estimators/random.h"
#include "tests/basics.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// The plane seen from above at a slant, +Z towards the camera or away from it.
CameraPose SlantedPose(bool towards = true) {
  CameraPose pose;
  const double side = towards ? -1.0 : 1.0;
  pose.rotation = ExpRotation({0.9, 0.1, 0.0}) * ExpRotation({0.0, 0.0, 0.4}) *
                  Vector3d(1.0, side, side).asDiagonal();
  pose.translation = {0.2, -0.3, 6.0};
  return pose;
}

Vector3d Image(const CameraPose& pose, double x, double y, double z = 0.0) {
  return pose.rotation * Vector3d(x, y, z) + pose.translation;
}

Vector3d ImageLine(const CameraPose& pose, const Vector2d& a, const Vector2d& b) {
  return Image(pose, a.x(), a.y()).cross(Image(pose, b.x(), b.y()));
}

class MetrologyTest : public ::testing::TestWithParam<bool> {
 protected:
  const CameraPose pose_ = SlantedPose(GetParam());
  Random random_{1};
};

INSTANTIATE_TEST_SUITE_P(BothSides, MetrologyTest, ::testing::Bool());

TEST_P(MetrologyTest, PointsComeBack) {
  for (int i = 0; i < 1000; ++i) {
    const Vector2d truth{random_.Uniform(-3.0, 3.0), random_.Uniform(-3.0, 3.0)};
    const Vector3d x = Image(pose_, truth.x(), truth.y());
    Vector2d point;
    ASSERT_TRUE(PointOnPlane(pose_, x / x.z(), &point));
    EXPECT_LT((point - truth).norm(), 1e-12);
    // What lies on the same line of sight, behind the camera, is not seen.
    EXPECT_FALSE(PointOnPlane(pose_, -x, &point));
    WorldRay ray;
    ASSERT_TRUE(RayOfPoint(pose_, x, &ray));
    const Vector3d to_point = Vector3d(truth.x(), truth.y(), 0.0) - ray.origin;
    EXPECT_LT(to_point.cross(ray.direction).norm(), 1e-12);
    EXPECT_GT(to_point.dot(ray.direction), 0.0);
  }
}

TEST_P(MetrologyTest, NothingIsSeenAtTheHorizonAndBeyond) {
  // The direction (1, 0, 0) of the plane, and what lies a little over and under it.
  const Vector3d horizon = pose_.rotation.col(0), up = pose_.rotation.col(2);
  const double side = up.dot(pose_.translation) < 0.0 ? 1.0 : -1.0;  // Towards the camera.
  Vector2d point(7.0, 7.0);
  EXPECT_FALSE(PointOnPlane(pose_, horizon + 0.01 * side * up, &point));
  EXPECT_EQ(point, Vector2d(7.0, 7.0));
  EXPECT_TRUE(PointOnPlane(pose_, horizon - 0.01 * side * up, &point));
  Vector3d line;
  EXPECT_FALSE(LineOnPlane(pose_, up, &line));
  double value = 7.0;
  const Vector3d seen = Image(pose_, 0.0, 0.0), unseen = horizon + 0.01 * side * up;
  EXPECT_FALSE(LengthOnPlane(pose_, seen, unseen, &value));
  EXPECT_FALSE(LengthRatio(pose_, {seen, Image(pose_, 1, 0), seen, unseen}, &value));
  EXPECT_FALSE(LengthRatio(pose_, {seen, Image(pose_, 1, 0), seen, seen}, &value));
  EXPECT_FALSE(AngleOnPlane(pose_, {seen, Image(pose_, 1, 0), seen, seen}, &value));
  EXPECT_FALSE(AreaOnPlane(pose_, {seen, Image(pose_, 1, 0), unseen}, &value));
  EXPECT_FALSE(AreaOnPlane(pose_, {seen, Image(pose_, 1, 0)}, &value));
  EXPECT_FALSE(HeightOverPlane(pose_, unseen, seen, &value));
  EXPECT_FALSE(HeightOverPlane(pose_, seen, up, &value));  // End-on.
  EXPECT_EQ(value, 7.0);
}

TEST_P(MetrologyTest, LinesComeBack) {
  for (int i = 0; i < 1000; ++i) {
    const Vector2d a{random_.Uniform(-3.0, 3.0), random_.Uniform(-3.0, 3.0)};
    const Vector2d b{random_.Uniform(-3.0, 3.0), random_.Uniform(-3.0, 3.0)};
    if ((a - b).norm() < 0.1) continue;
    const Vector3d image = 5.0 * ImageLine(pose_, a, b);
    Vector3d line;
    ASSERT_TRUE(LineOnPlane(pose_, image, &line));
    EXPECT_NEAR(line.head<2>().norm(), 1.0, 1e-14);
    EXPECT_NEAR(line.dot(a.homogeneous()), 0.0, 1e-11);
    EXPECT_NEAR(line.dot(b.homogeneous()), 0.0, 1e-11);
    WorldPlane plane;
    ASSERT_TRUE(PlaneOfLine(pose_, image, &plane));
    EXPECT_NEAR(plane.normal.dot(Vector3d(a.x(), a.y(), 0.0)) + plane.offset, 0.0, 1e-12);
    EXPECT_NEAR(plane.normal.dot(-pose_.rotation.transpose() * pose_.translation) + plane.offset,
                0.0, 1e-12);
  }
}

TEST_P(MetrologyTest, CirclesComeBackAsCircles) {
  for (int i = 0; i < 1000; ++i) {
    const Vector2d center{random_.Uniform(-2.0, 2.0), random_.Uniform(-2.0, 2.0)};
    const double radius = random_.Uniform(0.1, 2.0);
    CirclePose circle;
    circle.center = Image(pose_, center.x(), center.y()) / radius;
    circle.normal = pose_.rotation.col(2);
    const Matrix3d conic = -7.0 * ProjectCircle(circle);
    Ellipse ellipse;
    ASSERT_TRUE(ConicOnPlane(pose_, conic, &ellipse));
    EXPECT_LT((ellipse.center - center).norm(), 1e-11);
    EXPECT_NEAR(ellipse.a, radius, 1e-11);
    EXPECT_NEAR(ellipse.b, radius, 1e-11);
    WorldCone cone;
    ASSERT_TRUE(ConeOfConic(pose_, conic, &cone));
    const Vector3d rim = Vector3d(center.x() + radius, center.y(), 0.0) - cone.apex;
    EXPECT_NEAR(rim.dot(cone.form * rim), 0.0, 1e-11);
  }
}

TEST_P(MetrologyTest, ConicsOnOrBeyondTheHorizonHaveNoEllipse) {
  // Small circles of the image about a point of the horizon, and on either side of it.
  const Vector3d up = pose_.rotation.col(2);
  const double side = up.dot(pose_.translation) < 0.0 ? 1.0 : -1.0;
  Vector3d ahead = Vector3d::UnitZ() - up.z() * up;
  ahead.normalize();
  const auto circle = [&](double elevation) {
    const Vector3d x = ahead + elevation * side * up;
    return EllipseToConic({Vector2d(x.x() / x.z(), x.y() / x.z()), 0.02, 0.02, 0.0});
  };
  Ellipse ellipse;
  EXPECT_TRUE(ConicOnPlane(pose_, circle(-0.2), &ellipse));
  EXPECT_FALSE(ConicOnPlane(pose_, circle(0.0), &ellipse));
  EXPECT_FALSE(ConicOnPlane(pose_, circle(0.2), &ellipse));
}

TEST_P(MetrologyTest, HomographyRectifies) {
  Matrix3d H;
  ASSERT_TRUE(RectifyingHomography(pose_, &H));
  for (int i = 0; i < 1000; ++i) {
    const Vector2d truth{random_.Uniform(-3.0, 3.0), random_.Uniform(-3.0, 3.0)};
    const Vector3d p = H * Image(pose_, truth.x(), truth.y());
    EXPECT_GT(p.z(), 0.0);
    EXPECT_LT((p.hnormalized() - truth).norm(), 1e-12);
  }
}

TEST_P(MetrologyTest, RatiosAnglesAreasAndHeights) {
  const auto at = [this](double x, double y, double z = 0.0) { return Image(pose_, x, y, z); };
  double value;
  ASSERT_TRUE(LengthOnPlane(pose_, at(1, 1), at(4, 5), &value));
  EXPECT_NEAR(value, 5.0, 1e-12);
  ASSERT_TRUE(LengthRatio(pose_, {at(0, 0), at(1, 1), at(-1, 0), at(-1, 2)}, &value));
  EXPECT_NEAR(value, std::sqrt(0.5), 1e-13);
  ASSERT_TRUE(AngleOnPlane(pose_, {at(0, 0), at(1, 0), at(2, 1), at(2, 2)}, &value));
  EXPECT_NEAR(value, 0.5 * kPi, 1e-13);
  ASSERT_TRUE(AngleOnPlane(pose_, {at(0, 0), at(1, 0), at(2, 2), at(1, 1)}, &value));
  EXPECT_NEAR(value, -0.75 * kPi, 1e-13);
  ASSERT_TRUE(
      AreaOnPlane(pose_, {at(0, 0), at(2, 0), at(2, 1), at(1, 1), at(1, 2), at(0, 2)}, &value));
  EXPECT_NEAR(value, 3.0, 1e-12);
  for (const double z : {0.7, -0.4}) {
    ASSERT_TRUE(HeightOverPlane(pose_, at(1, -1), at(1, -1, z), &value));
    EXPECT_NEAR(value, z, 1e-12);
  }
  // A top that misses the perpendicular by a little: the nearest point of it.
  ASSERT_TRUE(HeightOverPlane(pose_, at(1, -1), at(1.001, -1, 0.7), &value));
  EXPECT_NEAR(value, 0.7, 2e-3);
}

TEST_P(MetrologyTest, RatiosDoNotDependOnTheUnit) {
  CameraPose small = pose_;
  small.translation *= 1e-150;
  const SegmentPair segments = {Image(pose_, 0, 0), Image(pose_, 1, 1), Image(pose_, -1, 0),
                                Image(pose_, -1, 2)};
  double ratio, same;
  ASSERT_TRUE(LengthRatio(pose_, segments, &ratio));
  ASSERT_TRUE(LengthRatio(small, segments, &same));
  EXPECT_NEAR(ratio, same, 1e-13);
}

TEST(MetrologyPoseTest, ACameraInThePlaneSeesNothingOfIt) {
  CameraPose pose;
  pose.rotation = ExpRotation({0.5 * kPi, 0.0, 0.0});
  pose.translation = {0.0, 0.0, 5.0};
  pose.rotation.col(2) = Vector3d(0.0, 1.0, 0.0);  // Exactly across the optical axis.
  Vector2d point;
  Matrix3d H;
  EXPECT_FALSE(PointOnPlane(pose, {0.1, 0.2, 1.0}, &point));
  EXPECT_FALSE(RectifyingHomography(pose, &H));
  pose.translation.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(PointOnPlane(pose, {0.1, 0.2, 1.0}, &point));
  EXPECT_FALSE(RectifyingHomography(pose, &H));
}

// Propagated standard deviations against the spread of simulated measurements; with a focal length
// that was refined, too, and is 10 % off what the camera says.
class MetrologyUncertaintyTest : public ::testing::TestWithParam<bool> {};

TEST_P(MetrologyUncertaintyTest, SigmaIsTheSpread) {
  using Matrix7d = Eigen::Matrix<double, 7, 7>;
  const bool focal_is_refined = GetParam();
  constexpr double kSigmaPx = 0.3;
  Camera given, camera;
  given.model = camera.model = CameraModel::kOpenCV;
  given.distortion = camera.distortion = {-0.2, 0.05, 1e-3, -5e-4};
  camera.fx = camera.fy = 800.0;
  PoseHypothesis h;
  h.cam_from_world = SlantedPose();
  const CameraPose& pose = h.cam_from_world;
  Random random(2);
  // Some full covariance, of 2 mrad, 1 % of the distance and 1 % of the focal length or so.
  Matrix7d root;
  for (int i = 0; i < 49; ++i) root(i / 7, i % 7) = 1e-3 * random.Normal();
  root.middleRows<3>(3) *= 6.0;
  root.row(6) *= focal_is_refined ? 4.0 : 0.0;
  const Matrix7d covariance = root * root.transpose();
  Eigen::Map<Matrix6d>(h.covariance.data()) = covariance.topLeftCorner<6, 6>();
  if (focal_is_refined) {
    h.focal_scale = 1.1;
    h.focal_sigma = std::sqrt(covariance(6, 6));
    Eigen::Map<Vector6d>(h.focal_covariance.data()) = covariance.topRightCorner<6, 1>();
  }
  given.fx = given.fy = camera.fx / h.focal_scale;

  // Four corners of a quadrangle, two segments, and a point over the first corner.
  const std::array<Vector3d, 5> corners = {Vector3d(0, 0, 0), Vector3d(1, 0.2, 0),
                                           Vector3d(-1, 1, 0), Vector3d(-0.5, 2, 0),
                                           Vector3d(0, 0, 0.8)};
  std::array<Vector2d, 5> p;
  for (std::size_t i = 0; i < 5; ++i) {
    const Vector3d seen = Image(pose, corners[i].x(), corners[i].y(), corners[i].z());
    ASSERT_TRUE(CameraToPixel(camera, seen, &p[i]));
  }
  std::array<Measurement, 6> m;
  ASSERT_TRUE(LengthRatio(h, given, {p[0], p[1], p[2], p[3]}, kSigmaPx, &m[0]));
  ASSERT_TRUE(AngleOnPlane(h, given, {p[0], p[1], p[2], p[3]}, kSigmaPx, &m[1]));
  ASSERT_TRUE(LengthOnPlane(h, given, {p[0], p[1]}, kSigmaPx, &m[2]));
  ASSERT_TRUE(AreaOnPlane(h, given, {p[0], p[1], p[3], p[2]}, kSigmaPx, &m[3]));
  ASSERT_TRUE(HeightOverPlane(h, given, {p[0], p[4]}, kSigmaPx, &m[4]));
  const auto distance = [](const CameraPose& at, const std::vector<Vector3d>&, double* value) {
    *value = std::abs(at.rotation.col(2).dot(at.translation));
    return true;
  };
  ASSERT_TRUE(MeasureOnPlane(distance, h, given, {}, kSigmaPx, &m[5]));
  EXPECT_NEAR(m[2].value, std::hypot(1.0, 0.2), 1e-7);
  EXPECT_NEAR(m[4].value, 0.8, 1e-7);

  std::array<double, 6> sum{};
  constexpr int kTrials = 20000;
  for (int trial = 0; trial < kTrials; ++trial) {
    Eigen::Matrix<double, 7, 1> z;
    for (int k = 0; k < 7; ++k) z[k] = random.Normal();
    const Eigen::Matrix<double, 7, 1> delta = root * z;
    CameraPose noisy = pose;
    noisy.rotation = ExpRotation(delta.head<3>()) * pose.rotation;
    noisy.translation += delta.segment<3>(3);
    Camera refined = given;
    refined.fx = refined.fy = given.fx * (h.focal_scale + delta[6]);
    std::array<Vector3d, 5> x;
    for (std::size_t i = 0; i < 5; ++i) {
      CalibratedPoint point;
      ASSERT_TRUE(PixelToCalibrated(refined, p[i] + Noise2(kSigmaPx, &random), &point));
      x[i] = point.Homogeneous();
    }
    std::array<double, 6> v;
    ASSERT_TRUE(LengthRatio(noisy, {x[0], x[1], x[2], x[3]}, &v[0]));
    ASSERT_TRUE(AngleOnPlane(noisy, {x[0], x[1], x[2], x[3]}, &v[1]));
    ASSERT_TRUE(LengthOnPlane(noisy, x[0], x[1], &v[2]));
    ASSERT_TRUE(AreaOnPlane(noisy, {x[0], x[1], x[3], x[2]}, &v[3]));
    ASSERT_TRUE(HeightOverPlane(noisy, x[0], x[4], &v[4]));
    ASSERT_TRUE(distance(noisy, {}, &v[5]));
    for (std::size_t k = 0; k < 6; ++k) sum[k] += std::pow(v[k] - m[k].value, 2);
  }
  const char* const names[] = {"ratio", "angle", "length", "area", "height", "distance"};
  for (std::size_t k = 0; k < 6; ++k) {
    // 20 000 trials: the spread is known to 0.5 %; the second order adds about one.
    EXPECT_NEAR(m[k].sigma / std::sqrt(sum[k] / kTrials), 1.0, 0.03) << names[k];
    EXPECT_GT(m[k].sigma, 1e-3 * std::abs(m[k].value)) << names[k];
  }
}

INSTANTIATE_TEST_SUITE_P(FocalLength, MetrologyUncertaintyTest, ::testing::Bool());

}  // namespace
}  // namespace circline
