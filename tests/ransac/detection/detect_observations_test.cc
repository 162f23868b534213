#include "circline/ransac/detection/detect_observations.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "circline/estimators/basics.h"
#include "tests/basics.h"
#include "tests/ransac/detection/detection_test_util.h"
#include "tests/ransac/detection/observations_test_util.h"

namespace circline {
namespace {

using detection_test::Axes;
using detection_test::AxesErrorDeg;
using detection_test::AxisDeg;
using detection_test::BetterNormalDeg;
using detection_test::Detect;
using detection_test::Develop;
using detection_test::DistortedCamera;
using detection_test::FisheyeCamera;
using detection_test::LookAt;
using detection_test::RenderPlane;
using detection_test::TestCamera;
using Eigen::Vector3d;

double Checker(double x, double y, double half_width, double half_height) {
  if (std::abs(x) > half_width || std::abs(y) > half_height) return 220.0;
  const int i = static_cast<int>(std::floor(x)), j = static_cast<int>(std::floor(y));
  return (i + j) % 2 == 0 ? 30.0 : 220.0;
}

// A board on the left half of the plane, a disc on the right.
double BoardAndDisc(double x, double y) {
  if (x > 0.6) return std::hypot(x - 2.5, y) < 1.5 ? 40.0 : 220.0;
  return Checker(x + 2.0, y, 2.0, 2.0);
}

TEST(DetectObservations, ABoardGivesItsAxesThroughEveryLens) {
  for (const Camera& camera : {TestCamera(), DistortedCamera(), FisheyeCamera()}) {
    const CameraPose pose = LookAt(30.0, -15.0, 12.0, camera.fx > 300.0 ? 12.0 : 5.5);
    const cv::Mat image =
        Develop(RenderPlane(camera, pose, 220.0,
                            [](double x, double y) { return Checker(x, y, 4.0, 3.0); }),
                0.7, 2.0);
    const Observations found = Detect(image, camera);
    Vector3d x, y;
    ASSERT_TRUE(Axes(found, &x, &y)) << camera.fx;
    EXPECT_LT(AxesErrorDeg(x, y, pose.rotation), 0.15) << camera.fx;
    EXPECT_EQ(found.frame.plane, "p0");
    ASSERT_GE(found.pencils.size(), 2U);
    EXPECT_EQ(found.pencils[0].id, "L0");
    EXPECT_EQ(found.pencils[0].plane, "p0");
    EXPECT_EQ(found.pencils[1].plane, "p0");
    EXPECT_GT(found.pencils[0].sigma_px, 0.0);
    for (const LineObservation& line : found.pencils[0].lines) {
      EXPECT_GE(line.points.size(), 2U);
      EXPECT_TRUE(line.fit.has_value());
    }
    EXPECT_TRUE(found.circles.empty());
    EXPECT_TRUE(found.message.empty()) << found.message;
  }
}

TEST(DetectObservations, DirectionsThatAreNotOrthogonalStayFree) {
  const Camera camera = TestCamera();
  const CameraPose pose = LookAt(30.0, -15.0, 12.0, 12.0);
  for (const double degrees : {86.0, 80.0, 60.0}) {
    const double s = std::cos(degrees * kDegree), c = std::sin(degrees * kDegree);
    const cv::Mat image = Develop(RenderPlane(camera, pose, 220.0, [=](double x, double y) {
      return Checker(x - y * s / c, y / c, 4.0, 3.0);  // Rows along x, columns along (s, c).
    }));
    const Observations found = Detect(image, camera);
    ASSERT_GE(found.pencils.size(), 2U);
    const Vector3d skew = s * pose.rotation.col(0) + c * pose.rotation.col(1);
    for (int k = 0; k < 2; ++k) {
      const PencilObservation& pencil = found.pencils[static_cast<std::size_t>(k)];
      EXPECT_EQ(pencil.direction, PencilDirection::kFree) << degrees;
      EXPECT_EQ(pencil.plane, "p0");
      const double error = std::min(AxisDeg(pencil.fit->direction, pose.rotation.col(0)),
                                    AxisDeg(pencil.fit->direction, skew));
      EXPECT_LT(error, 0.2) << degrees;
    }
  }
}

TEST(DetectObservations, CirclesJoinThePlaneTheyLieIn) {
  const Camera camera = TestCamera();
  const CameraPose pose = LookAt(40.0, -10.0, 8.0, 12.0);
  const cv::Mat image = Develop(RenderPlane(camera, pose, 220.0, BoardAndDisc), 0.7, 1.0);
  const Observations found = Detect(image, camera);
  Vector3d x, y;
  ASSERT_TRUE(Axes(found, &x, &y));
  EXPECT_LT(AxesErrorDeg(x, y, pose.rotation), 0.3);
  ASSERT_EQ(found.circles.size(), 1U);
  EXPECT_EQ(found.circles[0].id, "c0");
  EXPECT_EQ(found.circles[0].plane, "p0");
  EXPECT_LT(BetterNormalDeg(*found.circles[0].fit, pose.rotation.col(2)), 0.5);
}

TEST(DetectObservations, ACircleOfAnotherPlaneStaysOut) {
  // The board in the left half of the photo, a disc on a plane 50 degrees to it in the right half.
  const Camera camera = TestCamera();
  CameraPose board = LookAt(40.0, 0.0, 5.0, 12.0), disc = LookAt(-10.0, 40.0, 0.0, 12.0);
  board.translation.x() = -2.6;
  disc.translation.x() = 3.4;
  const cv::Mat left =
      RenderPlane(camera, board, 220.0, [](double x, double y) { return Checker(x, y, 2.0, 3.0); });
  const cv::Mat right = RenderPlane(camera, disc, 220.0, [](double x, double y) {
    return std::hypot(x, y) < 1.2 ? 40.0 : 220.0;
  });
  cv::Mat both;
  cv::min(left, right, both);
  const Observations found = Detect(Develop(both), camera);
  Vector3d x, y;
  ASSERT_TRUE(Axes(found, &x, &y));
  EXPECT_LT(AxesErrorDeg(x, y, board.rotation), 0.3);
  ASSERT_EQ(found.circles.size(), 1U);
  EXPECT_TRUE(found.circles[0].plane.empty());
  EXPECT_LT(BetterNormalDeg(*found.circles[0].fit, disc.rotation.col(2)), 0.5);
}

TEST(DetectObservations, WhatAContourSharesIsInItsCovariance) {
  const Camera camera = TestCamera();
  const cv::Mat image =
      Develop(RenderPlane(camera, LookAt(30.0, 0.0, 0.0, 8.0), 220.0, [](double x, double y) {
        return std::hypot(x, y) < 1.2 ? 40.0 : 220.0;
      }));
  const auto variance = [&](double contour_px) {
    DetectionOptions options;
    options.noise_model.contour_px = contour_px;
    Observations found;
    EXPECT_TRUE(DetectObservations(image, camera, options, &found).ok());
    EXPECT_EQ(found.circles.size(), 1U);
    return found.circles.empty() ? 0.0 : found.circles[0].fit->Covariance().trace();
  };
  const double points_alone = variance(0.0), shared = variance(0.1);
  EXPECT_GT(shared, 2.0 * points_alone);
  EXPECT_NEAR((variance(0.2) - points_alone) / (shared - points_alone), 4.0, 1e-6);
}

TEST(DetectObservations, AGridOfDotsIsOnePlane) {
  const Camera camera = DistortedCamera();
  const CameraPose pose = LookAt(35.0, 12.0, 10.0, 14.0);
  const cv::Mat image = Develop(RenderPlane(camera, pose, 200.0,
                                            [](double x, double y) {
                                              if (std::abs(x) > 4.4 || std::abs(y) > 3.3)
                                                return 200.0;
                                              const double u = x - 1.6 * std::round(x / 1.6),
                                                           v = y - 1.6 * std::round(y / 1.6);
                                              return std::hypot(u, v) < 0.55 ? 30.0 : 200.0;
                                            }),
                                0.7, 2.0);
  const Observations found = Detect(image, camera);
  ASSERT_EQ(found.circles.size(), 25U);
  int on_plane = 0;
  for (const CircleObservation& circle : found.circles) on_plane += circle.plane == "p0" ? 1 : 0;
  EXPECT_GE(on_plane, 23);
  EXPECT_EQ(found.circles[0].plane, "p0");
  EXPECT_EQ(found.frame.plane, "p0");
  // Rows and columns of the centres: two axes, each direction as good as five lines make it.
  ASSERT_EQ(found.pencils.size(), 2U);
  EXPECT_EQ(found.pencils[0].direction, PencilDirection::kX);
  EXPECT_EQ(found.pencils[1].direction, PencilDirection::kY);
  for (const PencilObservation& pencil : found.pencils) {
    EXPECT_EQ(pencil.lines.size(), 5U);
    EXPECT_EQ(pencil.plane, "p0");
    EXPECT_LT(std::min(AxisDeg(pencil.fit->direction, pose.rotation.col(0)),
                       AxisDeg(pencil.fit->direction, pose.rotation.col(1))),
              0.3);
  }
  EXPECT_EQ(found.message, "");
  // What is cut is said.
  DetectionOptions options;
  options.max_circles = 20;
  const Observations cut = Detect(image, camera, options);
  EXPECT_EQ(cut.circles.size(), 20U);
  EXPECT_CONTAINS(cut.message, "25 ellipses found, the best 20 kept");
}

TEST(DetectObservations, LimitsAreKept) {
  const Camera camera = TestCamera();
  const cv::Mat image =
      Develop(RenderPlane(camera, LookAt(40.0, -10.0, 8.0, 12.0), 220.0, BoardAndDisc));
  const Observations all = Detect(image, camera);
  ASSERT_GE(all.pencils.size(), 2U);
  ASSERT_EQ(all.circles.size(), 1U);
  DetectionOptions options;
  options.max_pencils = 0;
  EXPECT_TRUE(Detect(image, camera, options).pencils.empty());
  options.max_pencils = 1;
  EXPECT_EQ(Detect(image, camera, options).pencils.size(), 1U);
  options.max_circles = 0;
  EXPECT_TRUE(Detect(image, camera, options).circles.empty());
}

TEST(DetectObservations, TakesColourAndIsRepeatableWithAnyNumberOfThreads) {
  const Camera camera = TestCamera();
  const CameraPose pose = LookAt(40.0, -10.0, 8.0, 12.0);
  const cv::Mat gray = Develop(RenderPlane(camera, pose, 220.0, BoardAndDisc), 0.7, 5.0);
  cv::Mat color;
  cv::cvtColor(gray, color, cv::COLOR_GRAY2BGR);
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  const Observations a = Detect(gray, camera);
  cv::setNumThreads(4);
  const Observations b = Detect(color, camera);
  cv::setNumThreads(threads);
  ASSERT_EQ(a.circles.size(), 1U);
  ASSERT_EQ(b.circles.size(), 1U);
  for (std::size_t k = 0; k < a.circles.size(); ++k) {
    EXPECT_EQ(a.circles[k].points, b.circles[k].points);
    EXPECT_TRUE(a.circles[k].fit->conic == b.circles[k].fit->conic);
  }
  ASSERT_GE(a.pencils.size(), 2U);
  ASSERT_EQ(a.pencils.size(), b.pencils.size());
  for (std::size_t k = 0; k < a.pencils.size(); ++k) {
    EXPECT_TRUE(a.pencils[k].fit->direction == b.pencils[k].fit->direction);
    EXPECT_EQ(a.pencils[k].lines.size(), b.pencils[k].lines.size());
  }
}

TEST(DetectObservations, TakesTheSizeOfTheCameraFromThePhoto) {
  const cv::Mat image = Develop(
      RenderPlane(TestCamera(), LookAt(30.0, 10.0, 15.0, 6.0), 200.0, [](double x, double y) {
        return std::max(std::abs(x), std::abs(y)) < 1.5 && std::hypot(x, y) > 0.7 ? 60.0 : 200.0;
      }));
  DetectionOptions options;
  options.noise_model.camera.log_focal = 0.3;
  Camera guess = TestCamera();
  guess.fx = guess.fy = 1.3 * guess.fx;
  const Observations known = Detect(image, guess, options);
  guess.width = guess.height = 0;
  const Observations unknown = Detect(image, guess, options);
  EXPECT_EQ(unknown.camera.width, image.cols);
  EXPECT_EQ(unknown.camera.height, image.rows);
  EXPECT_EQ(unknown.camera.fx, known.camera.fx);
  ASSERT_EQ(unknown.circles.size(), known.circles.size());
  EXPECT_EQ(unknown.circles[0].fit->conic, known.circles[0].fit->conic);
}

TEST(DetectObservations, SaysWhatIsWrongWithTheInput) {
  const Camera camera = TestCamera(64, 48);
  const cv::Mat image(48, 64, CV_8UC1, cv::Scalar(9));
  Observations found;
  const auto message = [&](const cv::Mat& photo, const Camera& c, const DetectionOptions& options) {
    const Status status = DetectObservations(photo, c, options, &found);
    EXPECT_EQ(status.code, StatusCode::kInvalidArgument);
    EXPECT_TRUE(found.circles.empty() && found.pencils.empty());
    return status.message;
  };
  EXPECT_CONTAINS(message(cv::Mat(), camera, {}), "empty");
  EXPECT_CONTAINS(message(cv::Mat(48, 64, CV_16UC1), camera, {}), "8 bits");
  EXPECT_CONTAINS(message(cv::Mat(48, 64, CV_8UC2), camera, {}), "channels");
  EXPECT_CONTAINS(message(cv::Mat(64, 48, CV_8UC1), camera, {}), "48 x 64");
  Camera no_focal = camera;
  no_focal.fx = 0.0;
  EXPECT_FALSE(message(image, no_focal, {}).empty());
  DetectionOptions options;
  options.min_ellipse_axis_px = -1.0;
  EXPECT_CONTAINS(message(image, camera, options), "min_ellipse_axis_px");
  options = DetectionOptions();
  options.min_arc_deg = 0.0;
  EXPECT_CONTAINS(message(image, camera, options), "min_arc_deg");
  options = DetectionOptions();
  options.min_segment_length_px = std::nan("");
  EXPECT_CONTAINS(message(image, camera, options), "min_segment_length_px");
  options = DetectionOptions();
  options.max_circles = -1;
  EXPECT_CONTAINS(message(image, camera, options), "max_circles");
  options = DetectionOptions();
  options.max_pencils = -1;
  EXPECT_CONTAINS(message(image, camera, options), "max_pencils");
  options = DetectionOptions();
  options.max_shared_plane_deg = 0.0;
  EXPECT_CONTAINS(message(image, camera, options), "max_shared_plane_deg");
  options = DetectionOptions();
  options.noise_model.contour_px = -0.1;
  EXPECT_CONTAINS(message(image, camera, options), "contour_px");
}

}  // namespace
}  // namespace circline
