#include "circline/ransac/detection/ellipses/contour_support.h"

#include <gtest/gtest.h>

#include <cmath>

#include "circline/estimators/basics.h"
#include "circline/estimators/circle_pose.h"
#include "tests/ransac/detection/detection_test_util.h"

namespace circline {
namespace {

using detection_test::Develop;
using detection_test::DistortedCamera;
using detection_test::Render;
using detection_test::TestCamera;
using Eigen::Matrix3d;
using Eigen::Vector2d;

// A circle of `radius` pixels about (u, v), calibrated.
Matrix3d PixelCircle(const Camera& camera, double u, double v, double radius) {
  Ellipse e;
  e.center = Vector2d((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy);
  e.a = e.b = radius / camera.fx;
  return EllipseToConic(e);
}

TEST(Contour, SamplesAddUpToThePerimeterAndTurnOnce) {
  const Camera camera = TestCamera();
  Contour contour(camera);
  ASSERT_TRUE(contour.Project(PixelCircle(camera, 200.0, 150.0, 40.0), 4.0, 1000.0));
  EXPECT_NEAR(contour.major_px(), 40.0, 1e-9);
  EXPECT_NEAR(contour.minor_px(), 40.0, 1e-9);
  std::vector<ContourSample> samples;
  ASSERT_TRUE(contour.SampleEvery(1.0, &samples));
  EXPECT_NEAR(static_cast<double>(samples.size()), 2.0 * kPi * 40.0, 2.0);
  double length = 0.0, turn = 0.0;
  for (const ContourSample& s : samples) {
    length += s.length;
    turn += s.turn;
    const Vector2d out = s.pixel - Vector2d(200.0, 150.0);
    EXPECT_NEAR(out.norm(), 40.0, 1e-9);
    EXPECT_NEAR(s.normal.dot(out) / 40.0, 1.0, 1e-6);
  }
  EXPECT_NEAR(length, 2.0 * kPi * 40.0, 0.1);
  EXPECT_NEAR(turn, 2.0 * kPi, 0.01);
}

TEST(Contour, FollowsTheLens) {
  const Camera camera = DistortedCamera();
  CirclePose pose;
  pose.normal = Eigen::Vector3d(0.3, 0.4, -1.0).normalized();
  pose.center = Eigen::Vector3d(1.4, 0.8, 5.0);
  const Matrix3d conic = ProjectCircle(pose);
  Contour contour(camera);
  ASSERT_TRUE(contour.Project(conic, 4.0, 1000.0));
  std::vector<ContourSample> samples;
  ASSERT_TRUE(contour.SampleCount(50, &samples));
  for (const ContourSample& s : samples) {
    CalibratedPoint p;
    ASSERT_TRUE(PixelToCalibrated(camera, s.pixel, &p));
    EXPECT_NEAR(ConicDistancePx(p, conic), 0.0, 1e-6);
    const Eigen::Vector3d g = conic * p.Homogeneous();
    EXPECT_GT(p.GradientPerPixel(g.head<2>()).normalized().dot(s.normal), 0.99);
  }
}

TEST(Contour, RefusesWhatIsTooSmallTooLargeOrNoEllipse) {
  const Camera camera = TestCamera();
  Contour contour(camera);
  EXPECT_FALSE(contour.Project(PixelCircle(camera, 200.0, 150.0, 3.0), 4.0, 1000.0));
  EXPECT_FALSE(contour.Project(PixelCircle(camera, 200.0, 150.0, 300.0), 4.0, 200.0));
  EXPECT_FALSE(contour.Project(Matrix3d::Identity(), 4.0, 1000.0));
}

TEST(EdgeCollector, MeasuresCoverageAndRemembersWhatIsTaken) {
  // A dark disc of which a third is cut away by its own colour.
  const Camera camera = TestCamera(200, 200);
  const cv::Mat image = Develop(Render(200, 200, [](double u, double v) {
    const double angle = std::atan2(v - 100.0, u - 100.0);
    return std::abs(angle) < kPi / 3.0 || std::hypot(u - 100.0, v - 100.0) > 50.0 ? 150.0 : 40.0;
  }));
  const EdgeMap map = DetectEdges(image);
  Contour contour(camera);
  ASSERT_TRUE(contour.Project(PixelCircle(camera, 100.0, 100.0, 50.0), 4.0, 1000.0));
  std::vector<ContourSample> samples;
  ASSERT_TRUE(contour.SampleEvery(1.0, &samples));
  EdgeCollector collector(map);
  const double across = collector.QuickLook(samples, BrightSide::kOutside, 2.0);
  EXPECT_NEAR(across, 2.0 / 3.0, 0.08);
  EXPECT_LT(collector.QuickLook(samples, BrightSide::kInside, 2.0), 0.05);
  EXPECT_NEAR(collector.QuickLook(samples, BrightSide::kEither, 2.0), across, 0.05);
  Support support;
  collector.Collect(samples, BrightSide::kOutside, 2.0, &support);
  EXPECT_NEAR(support.Coverage(), 2.0 / 3.0, 0.04);
  EXPECT_NEAR(support.turn, 4.0 * kPi / 3.0, 0.25);
  EXPECT_LT(support.normal_median, 0.03);
  EXPECT_NEAR(static_cast<double>(support.points.size()), 4.0 * kPi / 3.0 * 50.0, 40.0);
  EXPECT_GT(support.gradient, 20.0);
  collector.Take(support.points);
  EXPECT_TRUE(collector.IsTaken(support.points[0]));
  collector.Collect(samples, BrightSide::kOutside, 2.0, &support);
  EXPECT_LT(support.Coverage(), 0.05);
}

TEST(EdgeCollector, MeasuresNormalsAtThePointsThemselves) {
  // The rim of a small disc turns by 12 degrees from one pixel to the next.
  const Camera camera = TestCamera(60, 60);
  const cv::Mat image = Develop(Render(60, 60, [](double u, double v) {
    return std::hypot(u - 30.2, v - 29.7) < 5.0 ? 40.0 : 200.0;
  }));
  const EdgeMap map = DetectEdges(image);
  Contour contour(camera);
  ASSERT_TRUE(contour.Project(PixelCircle(camera, 30.2, 29.7, 5.0), 4.0, 1000.0));
  std::vector<ContourSample> samples;
  ASSERT_TRUE(contour.SampleCount(40, &samples));
  EdgeCollector collector(map);
  Support support;
  collector.Collect(samples, BrightSide::kOutside, 1.5, &support);
  EXPECT_GT(support.Coverage(), 0.99);
  EXPECT_LT(support.normal_median, 1.0 * kDegree);
}

TEST(EdgeCollector, TakesEitherBrightSideIfAsked) {
  // A grey disc, half before black and half before white.
  const Camera camera = TestCamera(120, 120);
  const cv::Mat image = Develop(Render(120, 120, [](double u, double v) {
    return std::hypot(u - 60.0, v - 60.0) < 30.0 ? 120.0 : u < 60.0 ? 20.0 : 220.0;
  }));
  const EdgeMap map = DetectEdges(image);
  Contour contour(camera);
  ASSERT_TRUE(contour.Project(PixelCircle(camera, 60.0, 60.0, 30.0), 4.0, 1000.0));
  std::vector<ContourSample> samples;
  ASSERT_TRUE(contour.SampleEvery(1.0, &samples));
  EdgeCollector collector(map);
  Support support;
  for (const BrightSide side : {BrightSide::kOutside, BrightSide::kInside}) {
    collector.Collect(samples, side, 1.5, &support);
    EXPECT_NEAR(support.Coverage(), 0.5, 0.08);
  }
  collector.Collect(samples, BrightSide::kEither, 1.5, &support);
  EXPECT_GT(support.Coverage(), 0.9);
}

}  // namespace
}  // namespace circline
