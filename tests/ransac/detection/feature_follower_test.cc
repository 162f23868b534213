#include "circline/ransac/detection/feature_follower.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <set>
#include <string>
#include <utility>

#include "circline/estimators/conic.h"
#include "tests/basics.h"
#include "tests/ransac/detection/detection_test_util.h"
#include "tests/ransac/detection/observations_test_util.h"

namespace circline {
namespace {

using detection_test::Detect;
using detection_test::Develop;
using detection_test::DistortedCamera;
using detection_test::LookAt;
using detection_test::RenderPlane;
using detection_test::TestCamera;
using Eigen::Vector2d;

// A chessboard of 6 x 5 squares of 0.2, and two discs above and below.
double Board(double x, double y) {
  for (const double side : {-1.0, 1.0}) {
    if (std::hypot(x - 0.4 * side, y - 0.85 * side) < 0.25) return 40.0;
  }
  if (std::abs(x) > 0.6 || std::abs(y) > 0.5) return 220.0;
  const int column = static_cast<int>(std::floor((x + 0.6) / 0.2));
  const int row = static_cast<int>(std::floor((y + 0.5) / 0.2));
  return (column + row) % 2 == 0 ? 40.0 : 220.0;
}

// The same without the disc above.
double BoardWithoutUpper(double x, double y) {
  return std::hypot(x - 0.4, y - 0.85) < 0.3 ? 220.0 : Board(x, y);
}

cv::Mat Photo(const Camera& camera, const CameraPose& pose, std::uint64_t seed) {
  return Develop(RenderPlane(camera, pose, 200.0, Board), 0.7, 2.0, seed);
}

CameraPose PoseAt(int frame) {
  CameraPose pose = LookAt(25.0 + 0.4 * frame, 10.0 - 0.3 * frame, 5.0 + 0.5 * frame, 3.5);
  pose.translation.x() = 0.02 * frame;
  return pose;
}

std::set<std::string> CircleIds(const Observations& observations) {
  std::set<std::string> ids;
  for (const CircleObservation& circle : observations.circles) ids.insert(circle.id);
  return ids;
}

Vector2d Centre(const CircleObservation& circle) {
  Ellipse ellipse;
  EXPECT_TRUE(circle.fit && ConicToEllipse(circle.fit->conic, &ellipse));
  return ellipse.center;
}

// Of the nearest circle, in standard deviations of its own centre would be nearly 0: both fit the
// same edges. Pixels.
double NearestCirclePx(const CircleObservation& circle, const Observations& other) {
  double nearest = 1e9;
  for (const CircleObservation& c : other.circles) {
    nearest = std::min(nearest, other.camera.fx * (Centre(c) - Centre(circle)).norm());
  }
  return nearest;
}

TEST(FeatureFollower, FollowedFeaturesAreThoseOfTheColdDetector) {
  for (const Camera& camera : {TestCamera(), DistortedCamera()}) {
    FollowOptions options;
    options.cold_every = 0;
    FeatureFollower follower(camera, options);
    Observations observations;
    std::set<std::string> ids;
    std::size_t num_lines = 0;
    for (int frame = 0; frame < 12; ++frame) {
      const cv::Mat photo = Photo(camera, PoseAt(frame), 1 + static_cast<std::uint64_t>(frame));
      ASSERT_TRUE(follower.Next(photo, &observations).ok());
      EXPECT_TRUE(observations.Validate().ok());
      EXPECT_EQ(follower.was_cold(), frame == 0);
      ASSERT_EQ(observations.circles.size(), 2U) << "frame " << frame;
      ASSERT_EQ(observations.pencils.size(), 2U) << "frame " << frame;
      std::size_t lines = 0;
      for (const PencilObservation& pencil : observations.pencils) lines += pencil.lines.size();
      if (frame == 0) {
        ids = CircleIds(observations);
        num_lines = lines;
      }
      EXPECT_EQ(CircleIds(observations), ids);
      EXPECT_GE(static_cast<double>(lines), 0.8 * static_cast<double>(num_lines));
      const Observations cold = Detect(photo, camera);
      for (const CircleObservation& circle : observations.circles) {
        EXPECT_LT(NearestCirclePx(circle, cold), 0.02);
      }
      // Roles stay, and directions are as good as cold ones.
      Eigen::Vector3d x, y;
      ASSERT_TRUE(detection_test::Axes(observations, &x, &y));
      EXPECT_LT(detection_test::AxesErrorDeg(x, y, PoseAt(frame).rotation), 0.3);
    }
  }
}

// Each circle keeps its id: it is the same one in the world.
TEST(FeatureFollower, IdsStayWithTheirCircles) {
  const Camera camera = TestCamera();
  FollowOptions options;
  options.cold_every = 4;
  FeatureFollower follower(camera, options);
  Observations observations;
  std::string upper;  // The one at (0.4, 0.85).
  for (int frame = 0; frame < 12; ++frame) {
    const CameraPose pose = PoseAt(frame);
    ASSERT_TRUE(follower.Next(Photo(camera, pose, 7), &observations).ok());
    EXPECT_EQ(follower.was_cold(), frame % 4 == 0);
    Vector2d pixel;
    ASSERT_TRUE(CameraToPixel(
        camera, pose.rotation * Eigen::Vector3d(0.4, 0.85, 0.0) + pose.translation, &pixel));
    CalibratedPoint expected;
    ASSERT_TRUE(PixelToCalibrated(camera, pixel, &expected));
    for (const CircleObservation& circle : observations.circles) {
      if ((Centre(circle) - expected.x).norm() > 0.02) continue;
      if (frame == 0) upper = circle.id;
      EXPECT_EQ(circle.id, upper) << "frame " << frame;
    }
  }
}

// A jump far beyond the search is followed where the pose is predicted.
TEST(FeatureFollower, LooksWhereThePosePredicts) {
  const Camera camera = TestCamera();
  FeatureFollower follower(camera, FollowOptions());
  Observations observations;
  const CameraPose before = PoseAt(0);
  CameraPose after = PoseAt(3);
  after.translation += Eigen::Vector3d(0.35, -0.2, 0.1);
  ASSERT_TRUE(follower.Next(Photo(camera, before, 3), &observations).ok());
  PoseHypothesis hypothesis;
  hypothesis.cam_from_world = before;
  follower.Move(hypothesis, after);
  ASSERT_TRUE(follower.Next(Photo(camera, after, 4), &observations).ok());
  EXPECT_FALSE(follower.was_cold());
  EXPECT_EQ(observations.circles.size(), 2U);
  EXPECT_EQ(observations.pencils.size(), 2U);
}

TEST(FeatureFollower, ACutIsSeenAndNamesNothingAfterWhatWasBefore) {
  const Camera camera = TestCamera();
  FeatureFollower follower(camera, FollowOptions());
  Observations before, after;
  ASSERT_TRUE(follower.Next(Photo(camera, PoseAt(0), 3), &before).ok());
  EXPECT_TRUE(follower.was_cut());  // There was nothing before.
  CameraPose elsewhere = LookAt(-30.0, 20.0, 50.0, 5.5);
  elsewhere.translation.x() = 0.9;
  const cv::Mat photo =
      Develop(RenderPlane(camera, elsewhere, 200.0,
                          [](double x, double y) { return std::hypot(x, y) < 0.7 ? 30.0 : 210.0; }),
              0.7, 2.0, 5);
  // One disc after a whole board: it may pass, and is another scene when it stays.
  for (int frame = 0; frame < 3; ++frame) {
    ASSERT_TRUE(follower.Next(photo, &after).ok());
    EXPECT_TRUE(follower.was_cold());
    EXPECT_EQ(follower.was_cut(), frame == 2);
    EXPECT_EQ(after.circles.size(), frame == 2 ? 1U : 0U);
  }
  ASSERT_EQ(after.circles.size(), 1U);
  EXPECT_EQ(CircleIds(before).count(after.circles[0].id), 0U);
}

// A covered frame, and a board that has moved on meanwhile, are no cut.
TEST(FeatureFollower, ACoveredFramePasses) {
  const Camera camera = TestCamera();
  FollowOptions options;
  options.detection.noise_model.camera.log_focal = 0.2;  // It is looked for, once.
  FeatureFollower follower(camera, options);
  Observations before, covered, after;
  ASSERT_TRUE(follower.Next(Photo(camera, PoseAt(0), 3), &before).ok());
  ASSERT_TRUE(
      follower.Next(detection_test::Noise(camera.width, camera.height, 2.0), &covered).ok());
  EXPECT_TRUE(covered.circles.empty() && covered.pencils.empty());
  EXPECT_EQ(before.stated_focal_px, camera.fx);
  EXPECT_EQ(covered.stated_focal_px, before.stated_focal_px);
  EXPECT_EQ(covered.camera.fx, before.camera.fx);
  EXPECT_FALSE(follower.was_cut());
  ASSERT_TRUE(follower.Next(Photo(camera, PoseAt(2), 3), &after).ok());
  EXPECT_FALSE(follower.was_cut());
  EXPECT_EQ(CircleIds(after), CircleIds(before));
}

TEST(FeatureFollower, FollowsWhatIsGivenAndNothingElse) {
  const Camera camera = TestCamera();
  FeatureFollower follower(camera, FollowOptions());
  Observations given = Detect(Photo(camera, PoseAt(0), 3), camera);
  ASSERT_EQ(given.circles.size(), 2U);
  given.circles.erase(given.circles.begin());
  given.circles[0].id = "plate";
  given.circles[0].radius = 0.25;
  given.pencils.clear();
  follower.Start(given);
  Observations observations;
  for (int frame = 1; frame < 5; ++frame) {
    ASSERT_TRUE(follower.Next(Photo(camera, PoseAt(frame), 3), &observations).ok());
    ASSERT_EQ(observations.circles.size(), 1U);
    EXPECT_EQ(observations.circles[0].id, "plate");
    EXPECT_EQ(observations.circles[0].radius, 0.25);
    EXPECT_TRUE(observations.pencils.empty());
  }
  // Out of sight for a frame: nothing, and then it is there again.
  ASSERT_TRUE(
      follower.Next(detection_test::Noise(camera.width, camera.height, 2.0), &observations).ok());
  EXPECT_TRUE(observations.circles.empty());
  ASSERT_TRUE(follower.Next(Photo(camera, PoseAt(5), 3), &observations).ok());
  EXPECT_EQ(observations.circles.size(), 1U);
}

// Its own number comes first for what is new, too: another disc is not the one that was given.
TEST(FeatureFollower, AStrangerDoesNotTakeTheIdOfWhatWasGiven) {
  const Camera camera = TestCamera();
  FeatureFollower follower(camera, FollowOptions());
  Observations given = Detect(Photo(camera, PoseAt(0), 3), camera);
  ASSERT_EQ(given.circles.size(), 2U);
  const auto off = [](const CircleObservation& circle, int frame) {
    const CameraPose pose = PoseAt(frame);
    const Eigen::Vector3d upper =
        pose.rotation * Eigen::Vector3d(0.4, 0.85, 0.0) + pose.translation;
    return (Centre(circle) - upper.hnormalized()).norm();
  };
  if (off(given.circles[1], 0) < off(given.circles[0], 0))
    std::swap(given.circles[0], given.circles[1]);
  given.circles.resize(1);
  given.circles[0].id = "c0";
  given.pencils.clear();
  given.frame = {};
  follower.Start(given);
  Observations observations;
  for (int frame = 1; frame < 6; ++frame) {
    const cv::Mat photo =
        Develop(RenderPlane(camera, PoseAt(frame), 200.0, BoardWithoutUpper), 0.7, 2.0, 3);
    ASSERT_TRUE(follower.Next(photo, &observations).ok());
    EXPECT_TRUE(observations.circles.empty()) << frame;
  }
  ASSERT_TRUE(follower.Next(Photo(camera, PoseAt(6), 3), &observations).ok());
  ASSERT_EQ(observations.circles.size(), 1U);
  EXPECT_EQ(observations.circles[0].id, "c0");
  EXPECT_LT(off(observations.circles[0], 6), 0.02);
}

// Rows and columns of a sheet of discs are lines through their centres: no edges.
TEST(FeatureFollower, RowsOfDiscsAreFollowed) {
  const Camera camera = TestCamera();
  FollowOptions options;
  options.cold_every = 0;
  FeatureFollower follower(camera, options);
  const auto discs = [](double x, double y) {
    if (std::abs(x) > 0.8 || std::abs(y) > 0.6) return 220.0;
    const double u = std::fmod(x + 0.8, 0.4) - 0.2, v = std::fmod(y + 0.6, 0.4) - 0.2;
    return std::hypot(u, v) < 0.12 ? 40.0 : 220.0;
  };
  Observations observations;
  for (int frame = 0; frame < 6; ++frame) {
    const cv::Mat photo = Develop(RenderPlane(camera, PoseAt(frame), 200.0, discs), 0.7, 2.0, 9);
    ASSERT_TRUE(follower.Next(photo, &observations).ok());
    EXPECT_EQ(follower.was_cold(), frame == 0);
    EXPECT_EQ(observations.circles.size(), 12U);
    Eigen::Vector3d x, y;
    ASSERT_TRUE(detection_test::Axes(observations, &x, &y)) << "frame " << frame;
    EXPECT_LT(detection_test::AxesErrorDeg(x, y, PoseAt(frame).rotation), 0.3);
  }
}

TEST(FeatureFollower, RefusesWhatDetectionRefusesAndStaysWhereItWas) {
  const Camera camera = TestCamera();
  FeatureFollower follower(camera, FollowOptions());
  Observations observations;
  ASSERT_TRUE(follower.Next(Photo(camera, PoseAt(0), 3), &observations).ok());
  const std::set<std::string> ids = CircleIds(observations);
  EXPECT_EQ(follower.Next(cv::Mat(), &observations).code, StatusCode::kInvalidArgument);
  const cv::Mat other_size(50, 60, CV_8U, cv::Scalar(0));
  EXPECT_EQ(follower.Next(other_size, &observations).code, StatusCode::kInvalidArgument);
  ASSERT_TRUE(follower.Next(Photo(camera, PoseAt(1), 3), &observations).ok());
  EXPECT_FALSE(follower.was_cold());
  EXPECT_EQ(CircleIds(observations), ids);

  FollowOptions bad;
  bad.search_px = 1.0;
  const Status status =
      FeatureFollower(camera, bad).Next(Photo(camera, PoseAt(0), 3), &observations);
  EXPECT_CONTAINS(status.message, "search_px");
}

}  // namespace
}  // namespace circline
