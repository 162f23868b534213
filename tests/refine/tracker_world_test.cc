// The world of a tracker: what joins its map, and when another one begins.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cstddef>

#include "apps/benchmark/trajectory.h"
#include "circline/refine/pose_tracker.h"
#include "tests/refine/simulated_options.h"

namespace circline {
namespace {

// 0.5 px of noise, and nothing hidden; a circle or two, and lines along X.
TrajectoryOptions Quiet(bool second_circle, bool pencil, int num_frames = 100) {
  TrajectoryOptions trajectory;
  trajectory.num_frames = num_frames;
  trajectory.noise_px = 0.5;
  trajectory.occluded = 0.0;
  trajectory.second_circle = second_circle;
  trajectory.pencil = pencil;
  return trajectory;
}

// A circle of the plane that turns up later carries the pose where the first one is hidden.
TEST(TrackerWorldTest, LearnsCirclesAndUsesThem) {
  const TrajectoryOptions trajectory = Quiet(true, false);
  const Trajectory sequence(trajectory, 10);
  PoseTracker tracker(ExactOptions(trajectory));
  Random noise(11);
  for (std::size_t k = 0; k < sequence.frames.size(); ++k) {
    Observations seen = sequence.Observe(sequence.frames[k], &noise);
    constexpr std::size_t kBothFrom = 30, kHiddenFrom = 60;
    if (k < kBothFrom) seen.circles.resize(1);
    if (k >= kHiddenFrom) seen.circles.erase(seen.circles.begin());
    const TrackedPose tracked = tracker.Update(seen, static_cast<double>(k) / 30.0);
    ASSERT_TRUE(tracked.estimate.status.ok());
    EXPECT_FALSE(tracked.predicted_only);
    EXPECT_EQ(tracked.reinitialized, k == 0);
    if (k < kHiddenFrom) continue;
    const PoseHypothesis& first = tracked.estimate.hypotheses.front();
    EXPECT_LT(NormalError(sequence.frames[k].pose, first), 0.05);
    const Eigen::Vector3d t = sequence.frames[k].pose.translation;
    EXPECT_LT((first.cam_from_world.translation.normalized() - t.normalized()).norm(), 0.02);
  }
}

// Directions alone tell no position: the first sure pose with circles begins another world.
TEST(TrackerWorldTest, CirclesAfterDirectionsStartAWorldWithPositions) {
  const TrajectoryOptions trajectory = Quiet(true, true, 40);
  const Trajectory sequence(trajectory, 10);
  PoseTracker tracker(ExactOptions(trajectory));
  Random noise(11);
  for (std::size_t k = 0; k < sequence.frames.size(); ++k) {
    constexpr std::size_t kCirclesFrom = 15;
    const CameraPose& truth = sequence.frames[k].pose;
    Observations seen = sequence.Observe(sequence.frames[k], &noise);
    PencilObservation& across = seen.pencils.emplace_back(seen.pencils[0]);
    across.id = "y";
    across.direction = PencilDirection::kY;
    for (std::size_t j = 0; j < across.lines.size(); ++j) {
      for (int i = 0; i < Trajectory::kLinePoints; ++i)
        across.lines[j].points[static_cast<std::size_t>(i)] =
            sequence.Pixel(truth, Trajectory::LineHeights()[j], Trajectory::AlongLine(i)) +
            Noise2(trajectory.noise_px, &noise);
    }
    for (CircleObservation& circle : seen.circles) circle.plane = seen.frame.plane = "floor";
    if (k < kCirclesFrom) {
      seen.circles.clear();
      seen.frame.plane.clear();
    }
    const TrackedPose tracked = tracker.Update(seen, static_cast<double>(k) / trajectory.fps);
    const PoseHypothesis first = Best(tracked.estimate);
    EXPECT_EQ(tracked.reinitialized, k == 0 || k == kCirclesFrom) << k;
    EXPECT_EQ(HasNote(tracked.estimate, "shows a circle"), k == kCirclesFrom) << k;
    EXPECT_EQ(first.circles.size(), k < kCirclesFrom ? 0U : 2U) << k;
    EXPECT_LT(NormalError(truth, first), 0.05) << k;
    if (k < kCirclesFrom) continue;
    EXPECT_LT(
        (first.cam_from_world.translation.normalized() - truth.translation.normalized()).norm(),
        0.02)
        << k;
  }
}

// One direction alone leaves the pose vague after a second: what tells it then begins another
// world.
TEST(TrackerWorldTest, APoseThatHasBecomeVagueGivesWayToAnotherWorlds) {
  const TrajectoryOptions trajectory = Quiet(false, true);
  const Trajectory sequence(trajectory, 4);
  PoseTracker tracker(ExactOptions(trajectory));
  Random noise(11);
  for (std::size_t k = 0; k < sequence.frames.size(); ++k) {
    constexpr std::size_t kHiddenFrom = 10, kOtherFrom = 60;
    Observations seen = sequence.Observe(sequence.frames[k], &noise);
    if (k >= kHiddenFrom && k < kOtherFrom) seen.circles.clear();
    if (k >= kOtherFrom) {
      seen.circles[0].id = "other";
      seen.circles[0].plane = seen.pencils[0].plane = seen.frame.plane = "another";
    }
    const TrackedPose tracked = tracker.Update(seen, static_cast<double>(k) / trajectory.fps);
    const PoseHypothesis first = Best(tracked.estimate);
    EXPECT_EQ(tracked.reinitialized, k == 0 || k == kOtherFrom) << k;
    EXPECT_EQ(HasNote(tracked.estimate, "vague"), k == kOtherFrom) << k;
    if (k >= kHiddenFrom && k < kOtherFrom) continue;
    EXPECT_LT(NormalError(sequence.frames[k].pose, first), 0.05) << k;
  }
}

// A detector that looks anew may call another axis of the world X: the track goes on.
TEST(TrackerWorldTest, AxesThatAreNamedAnewAreDirectionsLikeOthers) {
  TrajectoryOptions trajectory;
  trajectory.pencil = true;
  trajectory.occluded = 0.0;
  trajectory.num_frames = 20;
  constexpr std::size_t kAnew = 10;
  const Trajectory sequence(trajectory, 4);
  PoseTracker tracker(ExactOptions(trajectory));
  Random noise(6);
  for (std::size_t k = 0; k < sequence.frames.size(); ++k) {
    Observations seen = sequence.Observe(sequence.frames[k], &noise);
    if (k >= kAnew) {
      seen.pencils[0].id = "another";
      seen.pencils[0].direction = PencilDirection::kY;
    }
    const TrackedPose tracked = tracker.Update(seen, static_cast<double>(k) / trajectory.fps);
    ASSERT_TRUE(tracked.estimate.status.ok()) << tracked.estimate.status.message;
    EXPECT_EQ(tracked.reinitialized, k == 0) << k;
    EXPECT_FALSE(tracked.predicted_only) << k;
    EXPECT_TRUE(tracked.estimate.hypotheses.front().left_out.empty()) << k;
  }
}

}  // namespace
}  // namespace circline
