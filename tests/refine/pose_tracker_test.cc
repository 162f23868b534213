// Sequences of frames: the right pose of several, sureness that is true, maps, cameras.
#include "circline/refine/pose_tracker.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>

#include "apps/benchmark/trajectory.h"
#include "tests/refine/simulated_options.h"
#include "tests/trials.h"

namespace circline {
namespace {

// Runs a tracker over a sequence; calls visit(k, frame, tracked).
template <typename Visit>
void Track(const Trajectory& sequence, const TrackerOptions& options, std::uint64_t seed,
           bool gyroscope, const Visit& visit) {
  PoseTracker tracker(options);
  Random noise(seed);
  for (std::size_t k = 0; k < sequence.frames.size(); ++k) {
    const Trajectory::Frame& frame = sequence.frames[k];
    MotionPrior motion;
    if (gyroscope && k > 0) motion = Gyroscope(sequence.frames[k - 1].pose, frame.pose);
    const double time = static_cast<double>(k) / sequence.options().fps;
    const TrackedPose tracked = tracker.Update(sequence.Observe(frame, &noise), time, motion);
    ASSERT_TRUE(tracked.estimate.status.ok()) << tracked.estimate.status.message;
    ASSERT_FALSE(tracked.estimate.hypotheses.empty());
    visit(k, frame, tracked);
  }
}

// 2 px of noise, a fifth of the frames without anything.
class SequencesTest : public testing::TestWithParam<int> {};

TEST_P(SequencesTest, BestIsRightAndSurenessIsTrue) {
  TrajectoryOptions trajectory;
  trajectory.pencil = GetParam() == 0;
  trajectory.second_circle = GetParam() == 1;
  const bool gyroscope = GetParam() == 2;
  int held_to_account = 0, right = 0, all = 0, sure_and_wrong = 0;
  double nees = 0.0;
  for (int trial = 0; trial < Trials(12); ++trial) {
    const auto seed = static_cast<std::uint64_t>(100 + trial);
    const Trajectory sequence(trajectory, seed);
    Track(sequence, ExactOptions(trajectory), seed, gyroscope,
          [&](std::size_t k, const Trajectory::Frame& frame, const TrackedPose& tracked) {
            const PoseHypothesis& first = tracked.estimate.hypotheses.front();
            constexpr double kRight = 0.3;  // Radians: the other pose is about 1 away.
            const bool is_right = NormalError(frame.pose, first) < kRight;
            ++all;
            sure_and_wrong += !is_right && first.probability >= 0.95 ? 1 : 0;
            constexpr std::size_t kFramesOfMotion = 30;
            if (k < kFramesOfMotion) return;
            ++held_to_account;
            right += is_right ? 1 : 0;
            if (trajectory.pencil) nees += RotationNees(first, frame.pose);
          });
  }
  if (kSanitized) return;
  EXPECT_GE(right, 0.99 * held_to_account);
  EXPECT_LE(sure_and_wrong, 0.005 * all);
  // Errors of neighbouring frames are not independent: about a hundred that are.
  if (trajectory.pencil) {
    EXPECT_NEAR(nees / held_to_account, 3.0, 1.2);
  }
}

INSTANTIATE_TEST_SUITE_P(PoseTracker, SequencesTest, testing::Values(0, 1, 2));

// A disc that turns before a camera that stands still, as far as anybody sees: no information.
TEST(PoseTrackerTest, OneCircleThatDoesNotMoveKeepsBothPosesInOrder) {
  TrajectoryOptions trajectory;
  trajectory.num_frames = 2;
  trajectory.noise_px = 0.5;
  const Trajectory sequence(trajectory, 3);
  PoseTracker tracker(ExactOptions(trajectory));
  Random noise(5);
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  for (int k = 0; k < Trials(200); ++k) {
    const TrackedPose tracked =
        tracker.Update(sequence.Observe(sequence.frames[0], &noise), k / 30.0);
    ASSERT_EQ(tracked.estimate.hypotheses.size(), 2U);
    const PoseHypothesis& first = tracked.estimate.hypotheses[0];
    EXPECT_GT(first.probability, 0.3);
    EXPECT_LT(first.probability, 0.7);
    if (k == 0) normal = first.cam_from_world.rotation.col(2);
    EXPECT_GT(normal.dot(first.cam_from_world.rotation.col(2)), 0.95);
  }
}

// The errors that the points of a contour share stay where it stays: of frames in which it does not
// move the second says nothing more of the two poses, nor of the focal length. One in which it
// moves does.
TEST(PoseTrackerTest, ACameraAtRestTakesOnePhoto) {
  TrajectoryOptions trajectory;
  trajectory.noise_px = 0.1;
  trajectory.occluded = 0.0;
  TrackerOptions options = ExactOptions(trajectory);
  options.estimation.noise_model = NoiseModel();
  options.estimation.camera_sigma = CameraSigma();
  options.estimation.camera_sigma->log_focal = 0.25;
  const Trajectory sequence(trajectory, 3);
  const auto& frames = sequence.frames;
  double moved = 0.0;
  for (const bool is_at_rest : {true, false}) {
    PoseTracker tracker(options);
    double began = 0.0, sigma = 0.0;
    for (std::size_t k = 0; k < frames.size(); ++k) {
      Random noise(is_at_rest ? 7 : 7 + k);
      const TrackedPose tracked = tracker.Update(
          sequence.Observe(frames[is_at_rest ? 0 : k], &noise), static_cast<double>(k) / 30.0);
      ASSERT_FALSE(tracked.estimate.hypotheses.empty());
      const PoseHypothesis& first = tracked.estimate.hypotheses[0];
      const double probability = first.probability;
      if (k == 0) began = probability;
      if (k == 1) sigma = first.focal_sigma;
      if (is_at_rest) {
        EXPECT_NEAR(probability, began, 0.01) << k;
        if (k > 0) {
          EXPECT_NEAR(first.focal_sigma, sigma, 0.02 * sigma) << k;
        }
      } else {
        moved = std::max(moved, std::abs(probability - began));
      }
    }
  }
  EXPECT_GT(moved, 0.1);
}

TEST(PoseTrackerTest, RecoversFromAWrongFirstGuess) {
  TrajectoryOptions trajectory;
  trajectory.occluded = 0.0;
  int began_wrong = 0;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    const Trajectory sequence(trajectory, seed);
    Track(sequence, ExactOptions(trajectory), seed, true,
          [&](std::size_t k, const Trajectory::Frame& frame, const TrackedPose& tracked) {
            const double error = NormalError(frame.pose, tracked.estimate.hypotheses.front());
            if (k == 0) began_wrong += error > 0.3 ? 1 : 0;
            if (k + 1 == sequence.frames.size()) {
              EXPECT_LT(error, 0.1) << seed;
            }
          });
    if (kSanitized && began_wrong > 0) return;
  }
  EXPECT_GE(began_wrong, 3);
}

// A tilt of each circle against the plane stays the same from frame to frame: no number of frames
// averages it out.
TEST(PoseTrackerTest, ErrorsThatFramesShareDoNotAverageOut) {
  TrajectoryOptions trajectory;
  trajectory.num_frames = 1;
  trajectory.noise_px = 0.2;
  trajectory.second_circle = true;
  const Trajectory sequence(trajectory, 4);
  TrackerOptions options = ExactOptions(trajectory);
  options.estimation.noise_model = NoiseModel();
  PoseTracker tracker(options);
  Random noise(6);
  Eigen::Vector3d sigma = Eigen::Vector3d::Zero();
  for (int k = 0; k < 200; ++k) {
    const TrackedPose tracked =
        tracker.Update(sequence.Observe(sequence.frames[0], &noise), k * 1e-3);
    sigma = tracked.estimate.hypotheses.front().SigmaRotation();
  }
  // Two circles of that tilt.
  EXPECT_GT(sigma.maxCoeff(),
            0.9 * options.estimation.noise_model.circle_tilt_rad / std::sqrt(2.0));
}

TEST(PoseTrackerTest, KnownRadiusIsMetric) {
  TrajectoryOptions trajectory;
  trajectory.noise_px = 0.2;
  const Trajectory sequence(trajectory, 8);
  PoseTracker tracker(ExactOptions(trajectory));
  Random noise(9);
  for (std::size_t k = 0; k < sequence.frames.size(); ++k) {
    Observations seen = sequence.Observe(sequence.frames[k], &noise);
    for (CircleObservation& circle : seen.circles) circle.radius = 0.25;
    const TrackedPose tracked = tracker.Update(seen, static_cast<double>(k) / 30.0);
    const PoseHypothesis& first = tracked.estimate.hypotheses.front();
    EXPECT_TRUE(first.metric);
    EXPECT_NEAR(first.cam_from_world.translation.norm(),
                0.25 * sequence.frames[k].pose.translation.norm(), 0.1);
  }
}

// The turn about a lone circle's normal is known from the prior alone, in every frame.
TEST(PoseTrackerTest, APriorOfTheFirstPoseCountsInTheNextFrames) {
  TrajectoryOptions trajectory;
  trajectory.occluded = 0.0;
  trajectory.num_frames = 3;
  const Trajectory sequence(trajectory, 3);
  TrackerOptions options = ExactOptions(trajectory);
  constexpr double kSigma = 0.01;
  options.estimation.pose_prior.emplace();
  options.estimation.pose_prior->mean = sequence.frames[0].pose;
  for (std::size_t k = 0; k < 6; ++k)
    options.estimation.pose_prior->covariance[7 * k] = kSigma * kSigma;
  Track(sequence, options, 7, false,
        [](std::size_t k, const Trajectory::Frame&, const TrackedPose& tracked) {
          EXPECT_LT(tracked.estimate.hypotheses.front().SigmaRotation().maxCoeff(), 5.0 * kSigma)
              << k;
        });
}

TEST(PoseTrackerTest, LeavesOutWhatContradicts) {
  TrajectoryOptions trajectory;
  trajectory.second_circle = trajectory.pencil = true;
  trajectory.occluded = 0.0;
  trajectory.noise_px = 0.5;
  const Trajectory sequence(trajectory, 12);
  PoseTracker tracker(ExactOptions(trajectory));
  Random noise(13);
  for (std::size_t k = 0; k < 40; ++k) {
    Observations seen = sequence.Observe(sequence.frames[k], &noise);
    const bool is_odd = k == 30;
    if (is_odd) {
      for (Eigen::Vector2d& p : seen.circles[1].points) p.x() += 25.0;
    }
    const TrackedPose tracked = tracker.Update(seen, static_cast<double>(k) / 30.0);
    const PoseHypothesis& first = tracked.estimate.hypotheses.front();
    EXPECT_FALSE(tracked.predicted_only) << k;
    EXPECT_LT(NormalError(sequence.frames[k].pose, first), 0.05);
    ASSERT_EQ(first.left_out.size(), is_odd ? 1U : 0U) << k;
    if (is_odd) {
      EXPECT_EQ(first.left_out[0], "c1");
    }
  }
}

}  // namespace
}  // namespace circline
