// The world of a video, where its first frames do not tell the whole.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <opencv2/core.hpp>

#include "circline/ransac/detection/feature_follower.h"
#include "tests/basics.h"
#include "tests/ransac/detection/detection_test_util.h"

namespace circline {
namespace {

using detection_test::Develop;
using detection_test::LookAt;
using detection_test::RenderPlane;
using detection_test::TestCamera;

// Bricks on a wall, which stands on the floor at its X axis.
double Wall(double x, double y) {
  if (std::abs(x) > 0.9 || y > -0.1 || y < -0.9) return 220.0;
  const int row = static_cast<int>(std::floor(y / 0.2));
  const int column = static_cast<int>(std::floor((x + 0.9) / 0.3));
  return (column + row) % 2 == 0 ? 40.0 : 220.0;
}

double TwoDiscs(double x, double y) {
  return std::hypot(std::abs(x) - 0.5, y + 0.6) < 0.28 ? 40.0 : 220.0;
}

// Before the wall, or without it, `has_discs` on the floor.
cv::Mat Room(const Camera& camera, const CameraPose& pose, bool has_discs, std::uint64_t seed) {
  CameraPose of_wall = pose;
  of_wall.rotation = pose.rotation * ExpRotation(kPi / 2.0 * Eigen::Vector3d::UnitX());
  cv::Mat photo = RenderPlane(camera, of_wall, 200.0, Wall);
  if (has_discs) cv::min(photo, RenderPlane(camera, pose, 200.0, TwoDiscs), photo);
  return Develop(photo, 0.7, 2.0, seed);
}

// Directions alone tell no positions: their world gives way to that of the discs, and they take
// the roles that they have in it, under their names.
TEST(FollowedWorld, CirclesMakeTheWorldWhereOnlyDirectionsDid) {
  const Camera camera = TestCamera();
  FollowOptions options;
  options.cold_every = 2;
  FeatureFollower follower(camera, options);
  Observations wall, room;
  for (int frame = 0; frame < 8; ++frame) {
    constexpr int kDiscsCome = 4;
    const CameraPose pose = LookAt(55.0, 0.4 * frame, 0.0, 4.0);
    const cv::Mat photo =
        Room(camera, pose, frame >= kDiscsCome, 1 + static_cast<std::uint64_t>(frame));
    Observations& seen = frame < kDiscsCome ? wall : room;
    ASSERT_TRUE(follower.Next(photo, &seen).ok());
    EXPECT_TRUE(seen.Validate().ok());
    ASSERT_EQ(seen.pencils.size(), 2U) << frame;
    ASSERT_EQ(seen.circles.size(), frame < kDiscsCome ? 0U : 2U) << frame;
    for (const CircleObservation& circle : seen.circles)
      EXPECT_EQ(circle.plane, seen.frame.plane) << frame;
  }
  EXPECT_NE(room.frame.plane, wall.frame.plane);
  for (std::size_t k = 0; k < 2; ++k) {
    EXPECT_EQ(room.pencils[k].id, wall.pencils[k].id);
    EXPECT_EQ(wall.pencils[k].plane, wall.frame.plane);
    EXPECT_NE(room.pencils[k].plane, room.frame.plane);
  }
}

// A single direction has no pose: the discs are found in the frame in which they come.
TEST(FollowedWorld, LooksEverywhereWhileThereIsNoPose) {
  const Camera camera = TestCamera();
  FollowOptions options;
  options.cold_every = 0;
  FeatureFollower follower(camera, options);
  Observations seen;
  for (int frame = 0; frame < 4; ++frame) {
    const auto boards_and_discs = [&](double x, double y) {
      constexpr double kBoard = 0.15;
      const bool is_board = y > 0.0 && y < 0.9 && std::fmod(y, 2.0 * kBoard) < kBoard;
      return is_board ? 40.0 : frame < 2 ? 220.0 : TwoDiscs(x, y);
    };
    const CameraPose pose = LookAt(25.0, 10.0 + 0.3 * frame, 5.0, 3.5);
    const cv::Mat photo = Develop(RenderPlane(camera, pose, 200.0, boards_and_discs), 0.7, 2.0,
                                  1 + static_cast<std::uint64_t>(frame));
    ASSERT_TRUE(follower.Next(photo, &seen).ok());
    EXPECT_EQ(seen.pencils.size(), 1U) << frame;
    EXPECT_EQ(seen.circles.size(), frame < 2 ? 0U : 2U) << frame;
    EXPECT_EQ(follower.was_cold(), frame <= 2) << frame;
  }
}

}  // namespace
}  // namespace circline
