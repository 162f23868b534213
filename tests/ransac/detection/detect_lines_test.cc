#include "circline/ransac/detection/lines/detect_lines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "tests/ransac/detection/detection_test_util.h"

namespace circline {
namespace {

using detection_test::AxisDeg;
using detection_test::Develop;
using detection_test::DistortedCamera;
using detection_test::FisheyeCamera;
using detection_test::LookAt;
using detection_test::Noise;
using detection_test::Render;
using detection_test::RenderPlane;
using detection_test::TestCamera;
using Eigen::Vector2d;
using Eigen::Vector3d;

std::vector<DetectedLine> LinesOf(const cv::Mat& image, const Camera& camera,
                                  double min_length_px = 20.0) {
  const EdgeMap edges = DetectEdges(image);
  std::vector<DetectedLine> lines = DetectLines(edges, camera, min_length_px);
  for (std::size_t k = 0; k < lines.size(); ++k) {
    EXPECT_GE(lines[k].points.size(), 2U);
    EXPECT_GE(lines[k].length_px, min_length_px);
    EXPECT_NEAR(lines[k].fit.line.norm(), 1.0, 1e-9);
    EXPECT_TRUE(lines[k].fit.covariance.allFinite());
    if (k > 0) {
      EXPECT_LE(lines[k].length_px, lines[k - 1].length_px);
    }
  }
  return lines;
}

// The interpretation plane of the line x = 0 of the plane Z = 0.
Vector3d TrueLine(const CameraPose& pose) {
  return pose.translation.cross(pose.rotation.col(1)).normalized();
}

TEST(DetectLines, KeepsALongLineWholeThroughEveryLens) {
  for (const Camera& camera : {TestCamera(), DistortedCamera(), FisheyeCamera()}) {
    CameraPose pose = LookAt(20.0, 10.0, 25.0, 4.0);
    pose.translation.x() = camera.fx > 300.0 ? 1.1 : 2.2;  // Near the border, where the lens bends.
    const cv::Mat image = Develop(
        RenderPlane(camera, pose, 60.0, [](double x, double) { return x > 0.0 ? 180.0 : 60.0; }));
    const std::vector<DetectedLine> lines = LinesOf(image, camera);
    ASSERT_EQ(lines.size(), 1U) << camera.fx;
    EXPECT_GT(lines[0].length_px, 200.0);
    EXPECT_LT(AxisDeg(lines[0].fit.line, TrueLine(pose)), 0.02);
    EXPECT_LE(lines[0].sigma_px, 0.11);
    EXPECT_GT((lines[0].ends[1] - lines[0].ends[0]).norm(), 200.0);
    for (std::size_t i = 1; i < lines[0].points.size(); ++i) {
      EXPECT_NEAR((lines[0].points[i] - lines[0].points[i - 1]).norm(), 5.0, 2.0);
    }
  }
}

// A dark rim is the photo's; what runs a few pixels further in is the scene's.
TEST(DetectLines, LeavesOutWhatRunsAlongTheBorder) {
  Camera camera = TestCamera();
  camera.width = 960;
  camera.height = 720;
  for (const int rim : {2, 12}) {
    cv::Mat image(camera.height, camera.width, CV_8UC1, cv::Scalar(30.0));
    const cv::Rect inside(rim, rim, camera.width - 2 * rim, camera.height - 2 * rim);
    image(inside).setTo(200.0);
    image(cv::Rect(300, 200, 100, 400)).setTo(60.0);
    const std::vector<DetectedLine> lines = LinesOf(image, camera);
    EXPECT_EQ(lines.size(), rim == 2 ? 4U : 8U) << rim;
  }
}

TEST(DetectLines, JoinsTheSidesOfARowOfSquares) {
  const Camera camera = DistortedCamera();
  const CameraPose pose = LookAt(25.0, 15.0, 10.0, 9.0);
  const cv::Mat image = Develop(RenderPlane(camera, pose, 220.0, [](double x, double y) {
    if (std::abs(x) > 3.0 || std::abs(y) > 2.0) return 220.0;
    return (static_cast<int>(std::floor(x)) + static_cast<int>(std::floor(y))) % 2 == 0 ? 30.0
                                                                                        : 220.0;
  }));
  const std::vector<DetectedLine> lines = LinesOf(image, camera);
  // Seven lines along y (six squares wide) and five along x, each in one piece. The outer ones
  // border every other square only.
  ASSERT_GE(lines.size(), 12U);
  EXPECT_LE(lines.size(), 24U);
  int whole = 0;
  for (const DetectedLine& line : lines) {
    const double length = (line.ends[1] - line.ends[0]).norm();
    whole += length > 150.0 ? 1 : 0;
    const Vector3d l = line.fit.line;
    const double miss =
        std::min(std::abs(l.dot(pose.rotation.col(0))), std::abs(l.dot(pose.rotation.col(1))));
    if (length > 60.0) {
      EXPECT_LT(miss, 4e-3);
    }
  }
  EXPECT_GE(whole, 8);
}

TEST(DetectLines, JoinsSidesThatTheBrightBleedsAcross) {
  // Overexposed: the white is a third of a pixel wider on every side, so that the sides of a row of
  // squares lie on either side of their line in turn. Joined, the steps cancel.
  const Camera camera = TestCamera();
  const CameraPose pose = LookAt(25.0, 15.0, 10.0, 9.0);
  const double bleed = 0.3 * 9.0 / camera.fx;
  const cv::Mat image = Develop(RenderPlane(camera, pose, 220.0, [bleed](double x, double y) {
    if (std::abs(x) > 3.0 || std::abs(y) > 2.0) return 220.0;
    const double u = x - std::floor(x), v = y - std::floor(y);
    const bool inner = std::min({u, v, 1.0 - u, 1.0 - v}) > bleed;
    return inner && (static_cast<int>(std::floor(x)) + static_cast<int>(std::floor(y))) % 2 == 0
               ? 30.0
               : 220.0;
  }));
  int whole = 0;
  for (const DetectedLine& line : LinesOf(image, camera)) {
    if ((line.ends[1] - line.ends[0]).norm() < 150.0) continue;
    ++whole;
    const Vector3d l = line.fit.line;
    EXPECT_LT(
        std::min(std::abs(l.dot(pose.rotation.col(0))), std::abs(l.dot(pose.rotation.col(1)))),
        4e-3);
  }
  EXPECT_GE(whole, 6);
}

TEST(DetectLines, StatesHowWellItKnowsALine) {
  // The miss of the true direction, in standard deviations, over many noisy photos.
  double chi2 = 0.0;
  int count = 0;
  const Camera camera = TestCamera(160, 120, 200.0);
  const CameraPose pose = LookAt(10.0, 5.0, 30.0, 4.0);
  const cv::Mat clean =
      RenderPlane(camera, pose, 60.0, [](double x, double) { return x > 0.0 ? 180.0 : 60.0; });
  const Vector3d truth = TrueLine(pose);
  const Vector3d direction = pose.rotation.col(1);
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    const std::vector<DetectedLine> lines = LinesOf(Develop(clean, 0.7, 12.0, seed), camera);
    if (lines.empty() || AxisDeg(lines[0].fit.line, truth) > 1.0) continue;
    const double variance = direction.dot(lines[0].fit.covariance * direction);
    const double miss = lines[0].fit.line.dot(direction);
    chi2 += miss * miss / variance;
    ++count;
  }
  ASSERT_GE(count, 35);
  EXPECT_NEAR(chi2 / count, 1.0, 0.67);  // 40 trials scatter it by 0.22.
}

TEST(DetectLines, ACircleIsNoLine) {
  const cv::Mat image = Develop(Render(300, 300, [](double u, double v) {
    return std::hypot(u - 150.0, v - 150.0) < 90.0 ? 40.0 : 160.0;
  }));
  for (const DetectedLine& line : LinesOf(image, TestCamera(300, 300))) {
    EXPECT_LT(line.length_px, 45.0);  // Chords whose sagitta is within the noise.
  }
}

TEST(DetectLines, KeepsBentEdgesApart) {
  // Sides that bulge by 0.8 px over 80, by 0.1 px over 80, and by 3 px over 50: edges of a worn
  // thing, straight, and round.
  const auto bulge = [](double v, double middle, double half, double sagitta) {
    const double s = (v - middle) / half;
    return sagitta * (1.0 - s * s);
  };
  const cv::Mat image = Develop(Render(200, 120, [&](double u, double v) {
    const bool worn = u > 30.0 - bulge(v, 60.0, 40.0, 0.8) && u < 60.0 + bulge(v, 60.0, 40.0, 0.1);
    const bool round = u > 120.0 - bulge(v, 60.0, 25.0, 3.0) && u < 150.0;
    if (worn && std::abs(v - 60.0) < 40.0) return 40.0;
    return round && std::abs(v - 60.0) < 25.0 ? 40.0 : 160.0;
  }));
  const EdgeMap edges = DetectEdges(image);
  std::vector<DetectedLine> bent;
  const std::vector<DetectedLine> lines =
      DetectLines(edges, TestCamera(200, 120), 45.0, nullptr, &bent);
  const auto near = [](const DetectedLine& line, double u) {
    return std::abs(line.points[line.points.size() / 2].x() - u) < 2.0;
  };
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_TRUE(near(lines[0], 60.0));
  EXPECT_TRUE(near(lines[1], 150.0));
  ASSERT_EQ(bent.size(), 1U);
  EXPECT_TRUE(near(bent[0], 29.5));
  EXPECT_GT(bent[0].length_px, 70.0);
  EXPECT_EQ(LinesOf(image, TestCamera(200, 120), 45.0).size(), 2U);
}

TEST(DetectLines, DropsShortOnesAndSkippedPoints) {
  const cv::Mat image = Develop(Render(120, 120, [](double u, double v) {
    return u > 30.2 && u < 90.1 && v > 40.3 && v < 70.4 ? 40.0 : 160.0;
  }));
  const Camera camera = TestCamera(120, 120);
  EXPECT_EQ(LinesOf(image, camera).size(), 4U);
  EXPECT_EQ(LinesOf(image, camera, 40.0).size(), 2U);
  const EdgeMap edges = DetectEdges(image);
  const std::vector<std::uint8_t> skip(edges.points.size(), 1);
  EXPECT_TRUE(DetectLines(edges, camera, 20.0, &skip).empty());
}

TEST(DetectLines, FindsFewInNoiseAndNoneOnABlankImage) {
  const Camera camera = TestCamera(320, 240);
  EXPECT_TRUE(LinesOf(cv::Mat(240, 320, CV_8UC1, cv::Scalar(3)), camera).empty());
  EXPECT_LE(LinesOf(Noise(320, 240, 30.0), camera).size(), 3U);
}

}  // namespace
}  // namespace circline
