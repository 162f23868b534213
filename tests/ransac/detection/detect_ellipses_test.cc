#include "circline/ransac/detection/ellipses/detect_ellipses.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "apps/benchmark/detection_truth.h"
#include "circline/estimators/basics.h"
#include "circline/estimators/circle_pose.h"
#include "circline/estimators/conic.h"
#include "tests/ransac/detection/detection_test_util.h"

namespace circline {
namespace {

using detection_test::BetterNormalDeg;
using detection_test::DataFolder;
using detection_test::Develop;
using detection_test::DistortedCamera;
using detection_test::FisheyeCamera;
using detection_test::HasSet;
using detection_test::LookAt;
using detection_test::Noise;
using detection_test::Render;
using detection_test::RenderPlane;
using detection_test::TestCamera;
using Eigen::Vector2d;
using Eigen::Vector3d;

std::vector<DetectedEllipse> EllipsesOf(const cv::Mat& image, const Camera& camera,
                                        const EllipseOptions& options = {}) {
  const EdgeMap edges = DetectEdges(image);
  std::vector<DetectedEllipse> ellipses = DetectEllipses(edges, camera, options);
  for (const DetectedEllipse& e : ellipses) {
    EXPECT_TRUE(e.fit.conic.allFinite());
    EXPECT_GE(e.points.size(), 6U);
    for (const int i : e.points) EXPECT_LT(static_cast<std::size_t>(i), edges.points.size());
  }
  return ellipses;
}

// A dark disc of radius 1 on the plane of `pose`, within a bright one of `outer` if that is more.
cv::Mat Disc(const Camera& camera, const CameraPose& pose, double outer = 0.0, double noise = 0.0) {
  return Develop(RenderPlane(camera, pose, 120.0,
                             [outer](double x, double y) {
                               const double r = std::hypot(x, y);
                               return r < 1.0 ? 40.0 : r < outer ? 210.0 : 120.0;
                             }),
                 0.7, noise);
}

// 5 x 3 dark discs of radius 0.4. Of each what lies beyond `cut` from its middle, in a direction of
// its own, is cut off.
cv::Mat FifteenDiscs(double cut) {
  return Develop(
      RenderPlane(TestCamera(), LookAt(30.0, 5.0, 10.0, 14.0), 200.0, [cut](double x, double y) {
        if (std::abs(x) > 3.7 || std::abs(y) > 2.2) return 200.0;
        const double column = std::round(x / 1.5), row = std::round(y / 1.5);
        const double u = x - 1.5 * column, v = y - 1.5 * row, turn = column + 5.0 * row;
        const bool is_cut = std::cos(turn) * u + std::sin(turn) * v > cut;
        return std::hypot(u, v) < 0.4 && !is_cut ? 30.0 : 200.0;
      }));
}

TEST(DetectEllipses, FindsATiltedDiscThroughEveryLens) {
  for (const Camera& camera : {TestCamera(), DistortedCamera(), FisheyeCamera()}) {
    const double distance = camera.fx > 300.0 ? 5.0 : 2.5;
    for (const double tilt : {20.0, 45.0, 65.0}) {
      CameraPose pose = LookAt(tilt, 10.0, 0.0, distance);
      pose.translation += Vector3d(0.6, -0.3, 0.0);  // Off the axis, where the lens bends.
      const std::vector<DetectedEllipse> found = EllipsesOf(Disc(camera, pose), camera);
      ASSERT_EQ(found.size(), 1U) << "tilt " << tilt << " focal " << camera.fx;
      EXPECT_GT(found[0].coverage_deg, 350.0);
      EXPECT_EQ(found[0].bright, BrightSide::kOutside);
      EXPECT_LT(found[0].fit.rms_px, 0.1);
      EXPECT_LT(BetterNormalDeg(found[0].fit, pose.rotation.col(2)), 0.3) << "tilt " << tilt;
    }
  }
}

TEST(DetectEllipses, NeverRoundsAnEllipseToACircle) {
  Ellipse truth;
  truth.center = {150.3, 140.8};
  truth.a = 80.0;
  truth.b = 78.0;  // A tilt of 13 degrees.
  truth.angle = 0.7;
  const Eigen::Matrix3d conic = EllipseToConic(truth);
  const cv::Mat image = Develop(Render(300, 280, [&conic](double u, double v) {
    const Vector3d x(u, v, 1.0);
    return x.dot(conic * x) * conic(0, 0) < 0.0 ? 30.0 : 170.0;
  }));
  Camera camera = TestCamera(300, 280, 300.0);
  const std::vector<DetectedEllipse> found = EllipsesOf(image, camera);
  ASSERT_EQ(found.size(), 1U);
  Ellipse e;
  ASSERT_TRUE(ConicToEllipse(found[0].fit.conic, &e));
  EXPECT_NEAR(camera.fx * e.a, truth.a, 0.1);
  EXPECT_NEAR(camera.fx * e.b, truth.b, 0.1);
  EXPECT_NEAR(e.angle, truth.angle, 0.03);
}

TEST(DetectEllipses, GroupsTheRimsOfARing) {
  const Camera camera = TestCamera();
  const CameraPose pose = LookAt(40.0, 0.0, 0.0, 6.0);
  std::vector<DetectedEllipse> found = EllipsesOf(Disc(camera, pose, 1.6), camera);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_GE(found[0].concentric, 0);
  EXPECT_EQ(found[0].concentric, found[1].concentric);
  // The outer one is longer, and brighter inside; the inner one holds the dark disc.
  EXPECT_GT(found[0].length_px, found[1].length_px);
  EXPECT_EQ(found[0].bright, BrightSide::kInside);
  EXPECT_EQ(found[1].bright, BrightSide::kOutside);
}

// A rim in pieces of 9 degrees, too short to tell an ellipse, about the centre of another that is
// whole.
TEST(DetectEllipses, FindsARimInPiecesBesideAWholeOne) {
  const Camera camera = TestCamera();
  const CameraPose pose = LookAt(40.0, 0.0, 0.0, 4.0);
  const cv::Mat image = Develop(RenderPlane(camera, pose, 200.0, [](double x, double y) {
    const double r = std::hypot(x, y), sector = std::atan2(y, x) / kDegree / 18.0;
    const double edge = sector - std::floor(sector) < 0.5 ? 0.7 : 0.0;
    return r < edge ? 200.0 : r < 1.2 ? 30.0 : 200.0;
  }));
  const std::vector<DetectedEllipse> found = EllipsesOf(image, camera);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_LT(BetterNormalDeg(found[1].fit, pose.rotation.col(2)), 1.0);
  EXPECT_EQ(found[0].concentric, found[1].concentric);
  EXPECT_GE(found[0].concentric, 0);
}

// Of a thick rim's two edges nothing says that they lie in one plane.
TEST(DetectEllipses, LeavesTheEdgesOfOneRimApart) {
  const Camera camera = TestCamera();
  const std::vector<DetectedEllipse> found =
      EllipsesOf(Disc(camera, LookAt(40.0, 0.0, 0.0, 6.0), 1.12), camera);
  ASSERT_EQ(found.size(), 2U);
  for (const DetectedEllipse& e : found) EXPECT_EQ(e.concentric, -1);
}

TEST(DetectEllipses, KeepsNeighboursApart) {
  const std::vector<DetectedEllipse> found = EllipsesOf(FifteenDiscs(0.4), TestCamera());
  EXPECT_EQ(found.size(), 15U);
  for (const DetectedEllipse& e : found) EXPECT_EQ(e.concentric, -1);
}

TEST(DetectEllipses, FindsAnOccludedDisc) {
  const Camera camera = TestCamera();
  const CameraPose pose = LookAt(35.0, 20.0, 0.0, 5.0);
  // A bar across the middle and a quarter cut away: three arcs of one ellipse.
  const cv::Mat image = Develop(RenderPlane(camera, pose, 120.0,
                                            [](double x, double y) {
                                              if (std::abs(y) < 0.2 || (x > 0.3 && y > 0.0))
                                                return 120.0;
                                              return std::hypot(x, y) < 1.0 ? 40.0 : 120.0;
                                            }),
                                0.7, 2.0);
  const std::vector<DetectedEllipse> found = EllipsesOf(image, camera);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_GT(found[0].coverage_deg, 150.0);
  EXPECT_LT(found[0].coverage_deg, 290.0);
  EXPECT_LT(BetterNormalDeg(found[0].fit, pose.rotation.col(2)), 1.0);
}

// What hides 30 % of the rim runs 1.5 to 2.5 px beside it, as dark as the disc.
TEST(DetectEllipses, KeepsClearOfWhatRunsBesideTheRim) {
  const Camera camera = TestCamera();
  const CameraPose pose = LookAt(35.0, 20.0, 0.0, 6.0);
  const cv::Mat image = Develop(RenderPlane(camera, pose, 200.0,
                                            [](double x, double y) {
                                              const double r = std::hypot(x, y);
                                              return r < (x > 0.6 * r ? 1.03 : 1.0) ? 40.0 : 200.0;
                                            }),
                                0.7, 2.0);
  const std::vector<DetectedEllipse> found = EllipsesOf(image, camera);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_LT(BetterNormalDeg(found[0].fit, pose.rotation.col(2)), 0.3);
}

// The same, but brighter, and 6 to 8 px beside the rim: an arc of 108 degrees, of a rim of its own
// were the disc not there.
TEST(DetectEllipses, TakesTheEdgeOfWhatHidesARimForNone) {
  const Camera camera = TestCamera();
  const CameraPose pose = LookAt(35.0, 20.0, 0.0, 6.0);
  const auto found = [&](double disc) {
    return EllipsesOf(Develop(RenderPlane(camera, pose, 200.0,
                                          [disc](double x, double y) {
                                            const double r = std::hypot(x, y);
                                            if (r < 1.1 && x > 0.58 * r && x > 0.58) return 120.0;
                                            return r < 1.0 ? disc : 200.0;
                                          }),
                              0.7, 2.0),
                      camera);
  };
  const std::vector<DetectedEllipse> hidden = found(40.0), alone = found(200.0);
  ASSERT_EQ(hidden.size(), 1U);
  EXPECT_GT(hidden[0].coverage_deg, 220.0);
  EXPECT_LT(BetterNormalDeg(hidden[0].fit, pose.rotation.col(2)), 0.3);
  ASSERT_EQ(alone.size(), 1U);
  EXPECT_LT(alone[0].coverage_deg, 120.0);
}

// Small discs, each with a piece cut off that is too small to make their contours no ellipses at
// first sight.
TEST(DetectEllipses, FindsDiscsWithAPieceCutOff) {
  // Where a contour begins, and so is divided, is chance.
  EXPECT_GE(EllipsesOf(FifteenDiscs(0.3), TestCamera()).size(), 14U);
}

TEST(DetectEllipses, FindsAGreyDiscBeforeBlackAndWhite) {
  const Camera camera = TestCamera();
  const CameraPose pose = LookAt(40.0, 10.0, 0.0, 6.0);
  const cv::Mat image = Develop(RenderPlane(camera, pose, 20.0, [](double x, double y) {
    return std::hypot(x, y) < 1.0 ? 120.0 : x + 0.3 * y < 0.1 ? 20.0 : 220.0;
  }));
  const std::vector<DetectedEllipse> found = EllipsesOf(image, camera);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].bright, BrightSide::kEither);
  EXPECT_GT(found[0].coverage_deg, 300.0);
  EXPECT_LT(BetterNormalDeg(found[0].fit, pose.rotation.col(2)), 0.3);
}

TEST(DetectEllipses, FindsADiscAmongWhatTouchesIt) {
  // A small disc of the same colour grows out of the rim: one chain, the ellipse a part of it.
  const Camera camera = TestCamera();
  const CameraPose pose = LookAt(35.0, 10.0, 0.0, 5.0);
  const cv::Mat image = Develop(RenderPlane(camera, pose, 200.0, [](double x, double y) {
    return std::hypot(x, y) < 1.0 || std::hypot(x - 1.05, y - 0.2) < 0.25 ? 40.0 : 200.0;
  }));
  const std::vector<DetectedEllipse> found = EllipsesOf(image, camera);
  ASSERT_GE(found.size(), 1U);
  EXPECT_GT(found[0].coverage_deg, 290.0);
  EXPECT_LT(BetterNormalDeg(found[0].fit, pose.rotation.col(2)), 0.3);
}

TEST(DetectEllipses, UndoesWhatTheBendDoesToTheRim) {
  // The smoothing alone draws the rim inward by 0.06 px at a radius of 8 px, its ends by more.
  for (const double blur : {0.7, 1.2}) {
    Ellipse truth;
    truth.center = {60.4, 50.7};
    truth.a = 14.0;
    truth.b = 8.0;
    truth.angle = 0.6;
    const Eigen::Matrix3d conic = EllipseToConic(truth);
    const cv::Mat image = Develop(Render(120, 100,
                                         [&conic](double u, double v) {
                                           const Vector3d x(u, v, 1.0);
                                           return x.dot(conic * x) < 0.0 ? 30.0 : 190.0;
                                         }),
                                  blur);
    const Camera camera = TestCamera(120, 100, 300.0);
    const std::vector<DetectedEllipse> found = EllipsesOf(image, camera);
    ASSERT_EQ(found.size(), 1U);
    Ellipse e;
    ASSERT_TRUE(ConicToEllipse(found[0].fit.conic, &e));
    EXPECT_NEAR(camera.fx * e.a, truth.a, 0.03) << blur;
    EXPECT_NEAR(camera.fx * e.b, truth.b, 0.03) << blur;
    ASSERT_EQ(found[0].contour.size(), found[0].points.size());
  }
}

// Semi-axes in pixels.
Ellipse InPixels(const DetectedEllipse& found, const Camera& camera) {
  Ellipse e;
  EXPECT_TRUE(ConicToEllipse(found.fit.conic, &e));
  e.center = camera.fx * e.center + Vector2d(camera.cx, camera.cy);
  e.a *= camera.fx;
  e.b *= camera.fx;
  return e;
}

// A photograph blurred by motion: grey copies of the dots lie on either side of them, and their
// edges run beside the rims over part of these.
TEST(DetectEllipses, KeepsToTheRimsBesideAPenumbra) {
  if (!HasSet("ellipses-labelled")) GTEST_SKIP() << "no photographs in " << DataFolder();
  const std::string folder = DataFolder() + "/ellipses-labelled/", file = "dots_00005.png";
  const cv::Mat image = cv::imread(folder + file, cv::IMREAD_GRAYSCALE);
  const Camera camera = TestCamera(image.cols, image.rows, image.cols);
  std::vector<Ellipse> found;
  for (const DetectedEllipse& e : EllipsesOf(image, camera)) found.push_back(InPixels(e, camera));
  const cv::FileStorage storage(folder + "groundtruth.yml", cv::FileStorage::READ);
  int labels = 0, hits = 0;
  for (const cv::FileNode& node : storage["images"]) {
    if (apps::ReadText(node, "file") != file) continue;
    for (const cv::FileNode& label : node["ellipses"]) {
      const Ellipse truth = apps::ReadEllipse(apps::ReadMatrix(label, "ellipse"));
      ++labels;
      hits += std::any_of(found.begin(), found.end(), [&truth](const Ellipse& e) {
        return (e.center - truth.center).norm() < 0.5 && std::abs(e.a - truth.a) < 0.5 &&
               std::abs(e.b - truth.b) < 0.5;
      });
    }
  }
  EXPECT_EQ(labels, 60);
  EXPECT_GE(hits, 53);
}

TEST(DetectEllipses, RespectsItsLimits) {
  const Camera camera = TestCamera();
  const cv::Mat image = Disc(camera, LookAt(40.0, 0.0, 0.0, 6.0), 1.6);
  EllipseOptions options;
  options.min_axis_px = 80.0;  // The inner semi-axes are about 83 x 63, the outer ones 133 x 101.
  EXPECT_EQ(EllipsesOf(image, camera, options).size(), 1U);
}

TEST(DetectEllipses, FindsNoneWhereThereAreNone) {
  const Camera camera = TestCamera(320, 240);
  EXPECT_TRUE(EllipsesOf(cv::Mat(240, 320, CV_8UC1, cv::Scalar(100)), camera).empty());
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    EXPECT_TRUE(EllipsesOf(Noise(320, 240, 30.0, seed), camera).empty()) << seed;
  }
  const cv::Mat squares = Develop(Render(320, 240, [](double u, double v) {
    return std::fmod(u, 60.0) < 30.0 && std::fmod(v, 60.0) < 30.0 ? 40.0 : 190.0;
  }));
  EXPECT_TRUE(EllipsesOf(squares, camera).empty());
}

TEST(DetectEllipses, IsRepeatable) {
  const Camera camera = TestCamera();
  const cv::Mat image = Disc(camera, LookAt(40.0, 15.0, 0.0, 6.0), 1.6, 10.0);
  const std::vector<DetectedEllipse> a = EllipsesOf(image, camera), b = EllipsesOf(image, camera);
  ASSERT_EQ(a.size(), 2U);
  ASSERT_EQ(b.size(), 2U);
  for (std::size_t k = 0; k < a.size(); ++k) {
    EXPECT_EQ(a[k].points, b[k].points);
    EXPECT_TRUE(a[k].fit.conic == b[k].fit.conic);
  }
}

}  // namespace
}  // namespace circline
