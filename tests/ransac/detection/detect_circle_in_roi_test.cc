#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "circline/estimators/conic.h"
#include "circline/ransac/detection/detect_observations.h"
#include "tests/ransac/detection/detection_test_util.h"
#include "tests/ransac/detection/observations_test_util.h"

namespace circline {
namespace {

using detection_test::BetterNormalDeg;
using detection_test::Detect;
using detection_test::Develop;
using detection_test::DistortedCamera;
using detection_test::LookAt;
using detection_test::RenderPlane;
using detection_test::TestCamera;
using Eigen::Vector2d;

TEST(DetectCircleInRoi, FindsTheCircleOfTheRectangle) {
  const Camera camera = DistortedCamera();
  CameraPose pose = LookAt(35.0, 10.0, 0.0, 8.0);
  const cv::Mat image = Develop(RenderPlane(camera, pose, 200.0, [](double x, double y) {
    return std::min(std::hypot(x - 2.0, y), std::hypot(x + 2.0, y)) < 0.9 ? 40.0 : 200.0;
  }));
  const Observations all = Detect(image, camera);
  ASSERT_EQ(all.circles.size(), 2U);
  for (const CircleObservation& truth : all.circles) {
    Vector2d low = truth.points[0], high = low;
    for (const Vector2d& p : truth.points) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    const cv::Rect roi(static_cast<int>(low.x()) - 8, static_cast<int>(low.y()) - 8,
                       static_cast<int>(high.x() - low.x()) + 17,
                       static_cast<int>(high.y() - low.y()) + 17);
    CircleObservation circle;
    circle.id = "mine";
    circle.radius = 0.9;
    circle.second.emplace();  // Of the points that it had.
    const Status status = DetectCircleInRoi(image, camera, roi, DetectionOptions(), &circle);
    ASSERT_TRUE(status.ok()) << status.message;
    EXPECT_EQ(circle.id, "mine");
    EXPECT_EQ(circle.radius, 0.9);
    EXPECT_FALSE(circle.second);
    EXPECT_GT(circle.points.size(), 30U);
    EXPECT_LT(BetterNormalDeg(*circle.fit, pose.rotation.col(2)), 0.5);
    EXPECT_NEAR(circle.fit->irregularity, truth.fit->irregularity, 0.05);
    EXPECT_NE(circle.fit->irregularity, 1.0);
    for (const Vector2d& p : circle.points) {
      EXPECT_TRUE(roi.contains(cv::Point(static_cast<int>(p.x()), static_cast<int>(p.y()))));
      CalibratedPoint x;
      ASSERT_TRUE(PixelToCalibrated(camera, p, &x));
      EXPECT_LT(std::abs(ConicDistancePx(x, truth.fit->conic)), 0.5);
    }
  }
}

TEST(DetectCircleInRoi, RefusesWhereThereIsNone) {
  const Camera camera = TestCamera(100, 80);
  const cv::Mat image(80, 100, CV_8UC1, cv::Scalar(50));
  CircleObservation circle;
  EXPECT_EQ(DetectCircleInRoi(image, camera, cv::Rect(10, 10, 50, 50), {}, &circle).code,
            StatusCode::kRefused);
  EXPECT_EQ(DetectCircleInRoi(image, camera, cv::Rect(200, 10, 50, 50), {}, &circle).code,
            StatusCode::kInvalidArgument);
  EXPECT_EQ(DetectCircleInRoi(cv::Mat(), camera, cv::Rect(0, 0, 50, 50), {}, &circle).code,
            StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace circline
