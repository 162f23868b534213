#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "apps/benchmark/detection_truth.h"
#include "circline/estimators/basics.h"
#include "circline/estimators/random.h"
#include "circline/ransac/detection/detect_observations.h"
#include "circline/ransac/detection/edges.h"
#include "circline/ransac/detection/lines/detect_lines.h"
#include "circline/ransac/detection/structure/find_box.h"
#include "tests/basics.h"
#include "tests/ransac/detection/detection_test_util.h"
#include "tests/ransac/detection/observations_test_util.h"

namespace circline {
namespace {

using detection_test::Axes;
using detection_test::AxesErrorDeg;
using detection_test::AxisDeg;
using detection_test::BetterNormalDeg;
using detection_test::DataFolder;
using detection_test::Detect;
using detection_test::HasSet;
using Eigen::Matrix3d;
using Eigen::Vector3d;

// One photo of a set, its observations and its truth.
struct DetectedPhoto {
  std::string file;
  Observations found;
  Matrix3d rotation;
};

using PhotoVisitor = std::function<void(const cv::Mat& image, const Camera&, const cv::FileNode&)>;

void VisitSet(const std::string& set, std::size_t every, const PhotoVisitor& visit) {
  const std::string folder = DataFolder() + "/" + set;
  const cv::FileStorage storage(folder + "/groundtruth.yml", cv::FileStorage::READ);
  std::size_t k = 0;
  for (const cv::FileNode& node : storage["images"]) {
    if (k++ % every != 0) continue;
    const std::string file = apps::ReadText(node, "file");
    const cv::Mat image = cv::imread(folder + "/" + file, cv::IMREAD_COLOR);
    if (image.empty()) continue;
    Camera camera;
    ASSERT_TRUE(apps::CameraOf(storage.root(), node, image.size(), &camera));
    visit(image, camera, node);
  }
}

Matrix3d ReadRotation(const cv::FileNode& node, const char* key) {
  const cv::Mat rotation = apps::ReadMatrix(node, key);
  return rotation.empty() ? Matrix3d(Matrix3d::Zero()) : apps::ToEigen(rotation);
}

std::vector<DetectedPhoto> DetectSet(const std::string& set, std::size_t every) {
  std::vector<DetectedPhoto> photos;
  VisitSet(set, every, [&](const cv::Mat& image, const Camera& camera, const cv::FileNode& node) {
    photos.push_back(
        {apps::ReadText(node, "file"), Detect(image, camera), ReadRotation(node, "R")});
  });
  return photos;
}

double Median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 1e9 : values[values.size() / 2];
}

TEST(RealPhotographs, ChessboardsGiveTheirAxes) {
  if (!HasSet("chessboard-opencv")) GTEST_SKIP() << "no photographs in " << DataFolder();
  std::vector<double> errors;
  for (const DetectedPhoto& photo : DetectSet("chessboard-opencv", 4)) {
    Vector3d x, y;
    const bool found = Axes(photo.found, &x, &y);
    EXPECT_TRUE(found) << photo.file;
    if (found) errors.push_back(AxesErrorDeg(x, y, photo.rotation));
  }
  EXPECT_GE(errors.size(), 6U);
  EXPECT_LT(Median(errors), 0.5);
}

TEST(RealPhotographs, TheDiscOfTheTurntableIsFound) {
  if (!HasSet("turntable-teabox")) GTEST_SKIP() << "no photographs in " << DataFolder();
  std::vector<double> errors;
  for (const DetectedPhoto& photo : DetectSet("turntable-teabox", 2)) {
    double best = 180.0;
    for (const CircleObservation& circle : photo.found.circles) {
      if (circle.points.size() < 150) continue;  // The rim, not a print on the box.
      best = std::min(best, BetterNormalDeg(*circle.fit, photo.rotation.col(2)));
    }
    errors.push_back(best);
  }
  EXPECT_LT(Median(errors), 2.0);
}

// What FindBox takes for its least odds: normals at random, none within 8 degrees of a direction of
// what the photo shows, of which some are bound to meet three lines in a corner.
TEST(RealPhotographs, BoxesAreRareOnNormalsOfNothing) {
  int found = 0, normals = 0;
  for (const std::string set : {"turntable-teabox", "chessboard-opencv", "box-camprodon"}) {
    if (!HasSet(set)) GTEST_SKIP() << "no photographs in " << DataFolder();
    Random random(1);
    VisitSet(set, 2, [&](const cv::Mat& image, const Camera& camera, const cv::FileNode& node) {
      const Matrix3d axes = ReadRotation(node, set == "turntable-teabox" ? "box_axes_cam" : "R");
      cv::Mat gray;
      ASSERT_TRUE(ToGray(image, &gray).ok());
      const EdgeMap edges = DetectEdges(gray);
      std::vector<DetectedLine> bent;
      std::vector<DetectedLine> lines = DetectLines(edges, camera, 20.0, nullptr, &bent);
      lines.insert(lines.end(), bent.begin(), bent.end());
      for (int trial = 0; trial < 40; ++trial) {
        const Vector3d normal = Noise3(1.0, &random).normalized();
        if ((axes.transpose() * normal).cwiseAbs().maxCoeff() > std::cos(8.0 * kDegree)) continue;
        ++normals;
        found += FindBox(lines, {normal}).has_value() ? 1 : 0;
      }
    });
  }
  ASSERT_GT(normals, 800);
  // 26 of 888 when this was written: 3 %, and two standard deviations.
  EXPECT_LT(found, 0.04 * normals) << found << " of " << normals;
}

TEST(RealPhotographs, LargeDiscsInStrongDistortionAreFoundAndShareAPlane) {
  if (!HasSet("circles-discocal-tir")) GTEST_SKIP() << "no photographs in " << DataFolder();
  for (const DetectedPhoto& photo : DetectSet("circles-discocal-tir", 3)) {
    int good = 0, on_plane = 0;
    for (const CircleObservation& circle : photo.found.circles) {
      good += BetterNormalDeg(*circle.fit, photo.rotation.col(2)) < 3.0 ? 1 : 0;
      on_plane += circle.plane == "p0" ? 1 : 0;
    }
    EXPECT_GE(good, 11) << photo.file;
    EXPECT_GE(on_plane, 9) << photo.file;
  }
}

TEST(RealPhotographs, BoardsAmongClutterGiveAxesThatKnowTheirError) {
  if (!HasSet("chessboard-charuco-robot")) GTEST_SKIP() << "no photographs in " << DataFolder();
  std::vector<double> errors;
  for (const DetectedPhoto& photo : DetectSet("chessboard-charuco-robot", 2)) {
    Vector3d x, y;
    ASSERT_TRUE(Axes(photo.found, &x, &y)) << photo.file;
    double variance = 0.0;
    for (const PencilObservation& pencil : photo.found.pencils) {
      if (pencil.direction == PencilDirection::kX || pencil.direction == PencilDirection::kY) {
        variance = std::max(variance, pencil.fit->covariance.trace());
      }
    }
    errors.push_back(AxesErrorDeg(x, y, photo.rotation));
    EXPECT_LT(errors.back(), 3.0 / kDegree * std::sqrt(variance)) << photo.file;
  }
  EXPECT_LT(Median(errors), 1.0);
}

TEST(RealPhotographs, ABoxIsNotMixedWithWhatIsBehindIt) {
  if (!HasSet("box-camprodon")) GTEST_SKIP() << "no photographs in " << DataFolder();
  int spanned = 0;
  for (DetectedPhoto& photo : DetectSet("box-camprodon", 2)) {
    FitDirect(1.0, &photo.found);  // A box's edges come without.
    if (photo.found.frame.plane.empty()) continue;
    ++spanned;
    for (const PencilObservation& pencil : photo.found.pencils) {
      if (pencil.plane != photo.found.frame.plane || !pencil.fit) continue;
      double nearest = 180.0;
      for (int k = 0; k < 3; ++k) {
        nearest = std::min(nearest, AxisDeg(pencil.fit->direction, photo.rotation.col(k)));
      }
      EXPECT_LT(nearest, 3.0) << photo.file;
    }
  }
  EXPECT_EQ(spanned, 5);
}

// Streets climb and walls lean: the two directions are axes all the same, whose ties are soft.
TEST(RealPhotographs, AStreetHasAxesThoughItsWallsLean) {
  if (!HasSet("scene-lund")) GTEST_SKIP() << "no photographs in " << DataFolder();
  for (const DetectedPhoto& photo : DetectSet("scene-lund", 3)) {
    ASSERT_GE(photo.found.pencils.size(), 2U) << photo.file;
    EXPECT_EQ(photo.found.pencils[0].direction, PencilDirection::kX) << photo.file;
    EXPECT_EQ(photo.found.pencils[1].direction, PencilDirection::kY) << photo.file;
  }
}

}  // namespace
}  // namespace circline
