#include "circline/ransac/detection/structure/structure_focal.h"

#include <gtest/gtest.h>

#include <cmath>

#include "circline/ransac/detection/structure/look_for_focal.h"
#include "tests/ransac/detection/detected_line_scene.h"
#include "tests/ransac/detection/detection_test_util.h"
#include "tests/ransac/detection/observations_test_util.h"

namespace circline {
namespace {

using detection_test::AddEdge;
using detection_test::LookAt;
using detection_test::TestCamera;

CameraSigma Wide(double log_focal) {
  CameraSigma sigma;
  sigma.log_focal = log_focal;
  return sigma;
}

Camera Guess(double factor) {
  Camera camera = TestCamera();
  camera.fx *= factor;
  camera.fy *= factor;
  return camera;
}

// Along two or three directions at right angles.
PhotoEvidence Edges(const Eigen::Matrix3d& axes, int num_directions, double factor) {
  Random random(3);
  PhotoEvidence evidence;
  for (int k = 0; k < 60; ++k)
    AddEdge(axes.col(k % num_directions), 90.0, Guess(factor), &random, &evidence);
  return evidence;
}

double FromEdges(const PhotoEvidence& evidence, double factor, const CameraSigma& sigma) {
  const auto pencils = DetectPencilsApart(evidence.lines, 3, 1, 600.0);
  return LikeliestFocal(evidence, pencils, Guess(factor), sigma, 0.0).log_focal;
}

double FromEdges(const Eigen::Matrix3d& axes, int num_directions, double factor,
                 const CameraSigma& sigma) {
  return FromEdges(Edges(axes, num_directions, factor), factor, sigma);
}

// Whatever the guess, right angles are found where they are.
TEST(LikeliestFocal, RightAnglesTell) {
  const Eigen::Matrix3d axes = ExpRotation(Eigen::Vector3d(0.5, 0.6, 0.1));
  for (const int num_directions : {2, 3}) {
    for (const double factor : {0.6, 1.0, 1.6}) {
      EXPECT_NEAR(FromEdges(axes, num_directions, factor, Wide(0.5)), -std::log(factor), 0.05)
          << num_directions << " " << factor;
    }
  }
}

// A box with print along one of its directions: two edges along each of the others are no pencils.
TEST(LikeliestFocal, EdgesAroundTheOnlyPencilTell) {
  const Eigen::Matrix3d axes = ExpRotation(Eigen::Vector3d(0.5, 0.6, 0.1));
  for (const double factor : {0.6, 1.0, 1.6}) {
    Random random(3);
    PhotoEvidence evidence;
    for (int k = 0; k < 20; ++k) AddEdge(axes.col(0), 90.0, Guess(factor), &random, &evidence);
    for (int k = 0; k < 4; ++k)
      AddEdge(axes.col(1 + k % 2), 90.0, Guess(factor), &random, &evidence);
    EXPECT_NEAR(FromEdges(evidence, factor, Wide(0.5)), -std::log(factor), 0.05) << factor;
  }
}

// A level camera sees the upright edges of a house and those of one front at right angles at any
// focal length; a few of its other front, too few for a pencil, tell which.
TEST(LikeliestFocal, AFewEdgesOfTheThirdDirectionTell) {
  const Eigen::Matrix3d axes = ExpRotation(Eigen::Vector3d(0.0, 0.7, 0.0));
  for (const double factor : {0.7, 1.0, 1.4}) {
    Random random(5);
    PhotoEvidence evidence;
    for (int k = 0; k < 40; ++k) AddEdge(axes.col(k % 2), 90.0, Guess(factor), &random, &evidence);
    EXPECT_NEAR(FromEdges(evidence, factor, Wide(0.5)), 0.0, 0.1) << factor;
    for (int k = 0; k < 5; ++k) AddEdge(axes.col(2), 90.0, Guess(factor), &random, &evidence);
    EXPECT_NEAR(FromEdges(evidence, factor, Wide(0.5)), -std::log(factor), 0.06) << factor;
  }
}

// A principal point that is off turns all uprights against all that is level, which right angles
// make up for by another focal length, if it is taken for exact.
TEST(LikeliestFocal, ThePrincipalPointMayBeOff) {
  const Eigen::Matrix3d axes =
      ExpRotation(Eigen::Vector3d(0.08, 0.0, 0.0)) * ExpRotation(Eigen::Vector3d(0.0, 0.7, 0.0));
  const PhotoEvidence evidence = Edges(axes, 3, 1.0);
  for (const double factor : {0.7, 1.4}) {
    for (const double off : {-30.0, 30.0}) {
      Camera camera = Guess(factor);
      camera.cy += off;
      PhotoEvidence seen;
      for (const DetectedLine& line : evidence.lines) {
        seen.lines.emplace_back();
        ASSERT_TRUE(LineFromSegment(camera, line.ends, 0.1, &seen.lines.back()).ok());
      }
      const auto pencils = DetectPencilsApart(seen.lines, 3, 1, 600.0);
      CameraSigma sigma = Wide(0.5);
      const auto error = [&](double middle_px) {
        sigma.principal_point_px = middle_px;
        const LikelyFocal likeliest = LikeliestFocal(seen, pencils, camera, sigma, 0.0);
        return likeliest.log_focal + std::log(factor);
      };
      EXPECT_NEAR(error(20.0), 0.0, 0.02) << factor << " " << off;
      EXPECT_GT(std::abs(error(0.0)), 0.2) << factor << " " << off;
    }
  }
}

// What faces the camera says nothing, and the prior stays.
TEST(LikeliestFocal, FrontalEdgesLeaveThePrior) {
  const Eigen::Matrix3d axes = ExpRotation(Eigen::Vector3d(0.0, 0.0, 0.2));
  for (const double factor : {0.6, 1.6}) {
    EXPECT_NEAR(FromEdges(axes, 2, factor, Wide(0.5)), 0.0, 0.15) << factor;
  }
}

// A narrow prior is not given up for a right angle, a doubtful one is for three of them.
TEST(LikeliestFocal, PriorsCount) {
  const Eigen::Matrix3d axes = ExpRotation(Eigen::Vector3d(0.5, 0.6, 0.1));
  EXPECT_NEAR(FromEdges(axes, 3, 1.6, Wide(0.02)), 0.0, 0.06);
  CameraSigma doubtful = Wide(0.05);
  doubtful.doubtful_log_focal = 0.5;
  EXPECT_NEAR(FromEdges(axes, 3, 1.6, doubtful), -std::log(1.6), 0.05);
  EXPECT_NEAR(FromEdges(axes, 3, 1.6, Wide(1e20)), -std::log(1.6), 0.05);  // And it ends.
}

// Twelve discs of one sheet, all of a photo: the camera at which they have one plane, and what it
// was told stands beside.
TEST(DetectObservations, DiscsOfASheetHaveTheirPlaneAtAnyGuess) {
  const CameraPose pose = LookAt(35.0, 25.0, 10.0, 9.0);
  const auto discs = [](double x, double y) {
    const double i = std::round(x), j = std::round(y);
    const bool is_disc = std::abs(i) <= 2.0 && std::abs(j) <= 1.0;
    return is_disc && std::hypot(x - i, y - j) < 0.35 ? 30.0 : 220.0;
  };
  const cv::Mat image = detection_test::Develop(
      detection_test::RenderPlane(TestCamera(), pose, 220.0, discs), 0.7, 2.0);
  std::vector<double> focal_px;
  for (const double factor : {0.65, 1.0, 1.5}) {
    DetectionOptions options;
    const Observations sure = detection_test::Detect(image, Guess(factor), options);
    EXPECT_EQ(sure.camera.fx, Guess(factor).fx);
    EXPECT_EQ(sure.stated_focal_px, 0.0);
    options.noise_model.camera = Wide(0.5);
    const Observations found = detection_test::Detect(image, Guess(factor), options);
    EXPECT_NEAR(std::log(found.camera.fx / TestCamera().fx), 0.0, 0.1) << factor;
    focal_px.push_back(found.camera.fx);
    EXPECT_NEAR(focal_px.back(), focal_px.front(), 1e-6) << factor;
    EXPECT_NEAR(StatedLogFocal(found), std::log(Guess(factor).fx / found.camera.fx), 1e-12);
    int on_plane = 0;
    for (const CircleObservation& circle : found.circles) on_plane += circle.plane == "p0" ? 1 : 0;
    EXPECT_GE(on_plane, 14) << factor;
  }
}

// Through a known lens lines break at a wrong focal length; what is left contradicts nothing.
TEST(LookForFocal, WhereLinesBreakNothingIsFound) {
  const Eigen::Matrix3d axes = ExpRotation(Eigen::Vector3d(0.5, 0.6, 0.1));
  DetectionOptions options;
  options.noise_model.camera = Wide(0.5);
  Observations observations;
  observations.camera = Guess(1.6);
  double first = 0.0;
  int looks = 0;
  const auto collect = [&](const Camera& camera) {
    if (first == 0.0) first = camera.fx;
    ++looks;
    const bool is_first = std::abs(std::log(camera.fx / first)) < 0.01;
    PhotoEvidence seen = Edges(axes, 2, camera.fx / TestCamera().fx);
    if (!is_first) seen.lines.resize(12);
    return seen;
  };
  const PhotoEvidence evidence = LookForFocal(collect, options, 600.0, &observations);
  EXPECT_GT(looks, 1);
  EXPECT_NEAR(observations.camera.fx, first, 1e-9 * first);
  EXPECT_EQ(evidence.lines.size(), 60U);
}

}  // namespace
}  // namespace circline
