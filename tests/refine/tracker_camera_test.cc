// Trackers through a camera that is a guess.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <string>

#include "apps/benchmark/trajectory.h"
#include "circline/refine/pose_tracker.h"
#include "tests/refine/simulated_options.h"
#include "tests/trials.h"

namespace circline {
namespace {

constexpr double kGuessSigma = 0.5;  // Of log f.

// Of the last hypothesis of sequences whose focal length is a guess.
struct GuessedTracks {
  double nees = 0.0;                         // Of log f, the mean.
  double sigma = 0.0;                        // Of log f, the mean.
  double within_two = 0.0;                   // Of its standard deviations: share.
  double wrong = 0.0, expected_wrong = 0.0;  // Poses, and the sum of 1 - p.
};

GuessedTracks RunGuessed(const TrajectoryOptions& trajectory, int trials) {
  GuessedTracks all;
  Random guesses(3);
  for (int trial = 0; trial < trials; ++trial) {
    const Trajectory sequence(trajectory, static_cast<std::uint64_t>(1000 + trial));
    TrackerOptions options = ExactOptions(trajectory);
    options.estimation.camera_sigma = CameraSigma();
    options.estimation.camera_sigma->log_focal = kGuessSigma;
    const double off = kGuessSigma * guesses.Normal();
    PoseTracker tracker(options);
    Random noise(static_cast<std::uint64_t>(trial + 1));
    PoseHypothesis last;
    double time = 0.0;
    for (const Trajectory::Frame& frame : sequence.frames) {
      Observations seen = sequence.Observe(frame, &noise);
      seen.camera.fx = seen.camera.fy = sequence.camera.fx * std::exp(off);
      const TrackedPose tracked = tracker.Update(seen, time, MotionPrior());
      last = Ok(tracked.estimate).hypotheses.front();
      time += 1.0 / trajectory.fps;
    }
    const double sigma = last.focal_sigma / last.focal_scale,
                 error = off + std::log(last.focal_scale);
    all.nees += error * error / (sigma * sigma) / trials;
    all.sigma += sigma / trials;
    all.within_two += (std::abs(error) < 2.0 * sigma ? 1.0 : 0.0) / trials;
    constexpr double kRight = 0.3;  // Radians: the other pose is about 1 away.
    all.wrong += NormalError(sequence.frames.back().pose, last) < kRight ? 0.0 : 1.0;
    all.expected_wrong += 1.0 - last.probability;
  }
  return all;
}

TrajectoryOptions Sequence(bool two_circles) {
  TrajectoryOptions trajectory;
  trajectory.num_frames = 40;
  trajectory.noise_px = 0.5;
  trajectory.occluded = 0.0;
  trajectory.second_circle = two_circles;
  return trajectory;
}

// Circles of later frames lie where they are seen through the camera found, not the one given.
TEST(GuessedTrackTest, ManyFramesTellTheFocalLengthAndHowWell) {
  const GuessedTracks tracks = RunGuessed(Sequence(true), Trials(60));
  if (kSanitized) return;
  EXPECT_LE(tracks.nees, 1.5);
  EXPECT_GE(tracks.within_two, 0.9);
  EXPECT_LE(tracks.sigma, 0.01);  // Of one frame 0.026.
  EXPECT_EQ(tracks.wrong, 0.0);
}

// A circle tells next to nothing of the focal length, however often it is seen.
TEST(GuessedTrackTest, ACircleLeavesTheFocalLengthAndThePoseAsOpenAsTheyAre) {
  const GuessedTracks tracks = RunGuessed(Sequence(false), Trials(60));
  EXPECT_GE(tracks.sigma, 0.95 * kGuessSigma);
  if (kSanitized) return;
  EXPECT_LE(tracks.nees, 1.5);
  EXPECT_GE(tracks.within_two, 0.9);
  EXPECT_LE(tracks.wrong, tracks.expected_wrong + 3.0 * std::sqrt(tracks.expected_wrong));
}

// What a later frame tells by itself, with more in it, counts.
TEST(GuessedTrackTest, AFrameThatTellsTheFocalLengthStartsAnew) {
  TrajectoryOptions trajectory = Sequence(true);
  const Trajectory sequence(trajectory, 7);
  TrackerOptions options = ExactOptions(trajectory);
  options.estimation.camera_sigma = CameraSigma();
  options.estimation.camera_sigma->log_focal = kGuessSigma;
  PoseTracker tracker(options);
  Random noise(7);
  int starts = 0;
  for (std::size_t k = 0; k < sequence.frames.size(); ++k) {
    constexpr std::size_t kAlone = 10;  // Frames without the second circle.
    Observations seen = sequence.Observe(sequence.frames[k], &noise);
    seen.camera.fx = seen.camera.fy = 1.5 * sequence.camera.fx;
    if (k < kAlone) seen.circles.resize(1);
    const TrackedPose tracked =
        tracker.Update(seen, static_cast<double>(k) / trajectory.fps, MotionPrior());
    const PoseHypothesis best = Best(tracked.estimate);
    starts += tracked.reinitialized ? 1 : 0;
    EXPECT_EQ(tracked.reinitialized, k == 0 || k == kAlone) << k;
    if (k == kAlone) {
      EXPECT_TRUE(HasNote(tracked.estimate, "tells the focal length"));
    }
    if (k >= kAlone) {
      EXPECT_LT(best.focal_sigma, 0.1);
      EXPECT_NEAR(1.5 * best.focal_scale, 1.0, 4.0 * 1.5 * best.focal_sigma);
    } else {
      EXPECT_GE(best.focal_sigma, 0.9 * kGuessSigma * best.focal_scale);
    }
  }
  EXPECT_EQ(starts, 2);
}

// A detector that took another focal length than the one stated: the prior stays about that.
TEST(GuessedTrackTest, TheCamerasPriorIsAboutTheStatedFocalLength) {
  TrajectoryOptions trajectory;
  trajectory.occluded = 0.0;
  trajectory.num_frames = 2;
  trajectory.depth = 40.0;
  const Trajectory sequence(trajectory, 3);
  TrackerOptions options = ExactOptions(trajectory);
  constexpr double kSigma = 0.2, kStated = 1.3;
  options.estimation.camera_sigma = CameraSigma::Exact();
  options.estimation.camera_sigma->log_focal = kSigma;
  PoseTracker tracker(options);
  Random noise(7);
  for (std::size_t k = 0; k < 2; ++k) {
    Observations seen = sequence.Observe(sequence.frames[k], &noise);
    seen.stated_focal_px = kStated * seen.camera.fx;
    const TrackedPose tracked = tracker.Update(seen, static_cast<double>(k) / 30.0);
    ASSERT_TRUE(tracked.estimate.status.ok()) << tracked.estimate.status.message;
    // One circle from afar says next to nothing of it.
    const PoseHypothesis& first = tracked.estimate.hypotheses.front();
    EXPECT_NEAR(first.focal_scale, kStated, 0.05) << k;
    EXPECT_GT(first.focal_sigma, 0.85 * kSigma * first.focal_scale) << k;
  }
}

}  // namespace
}  // namespace circline
