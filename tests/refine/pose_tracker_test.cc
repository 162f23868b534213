#include "circline/refine/pose_tracker.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "apps/benchmark/trajectory.h"
#include "tests/trials.h"

namespace circline {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

TrackerOptions ExactOptions(const TrajectoryOptions& trajectory) {
  TrackerOptions options;
  options.estimation.noise_model = NoiseModel::Exact();
  options.estimation.conic_loss.type = options.estimation.line_loss.type = LossType::kTrivial;
  options.turn_rate_sigma = trajectory.turn_rate_sigma;
  options.velocity_sigma = trajectory.velocity_sigma;
  options.initial_turn_rate_sigma = trajectory.initial_turn_rate_sigma;
  options.initial_velocity_sigma = trajectory.initial_velocity_sigma;
  return options;
}

double NormalError(const CameraPose& truth, const PoseHypothesis& h) {
  return std::acos(
      std::clamp(truth.rotation.col(2).dot(h.cam_from_world.rotation.col(2)), -1.0, 1.0));
}

// The turn between two frames, as a gyroscope without error has it.
MotionPrior Gyroscope(const CameraPose& before, const CameraPose& now) {
  constexpr double kSigma = 0.001;
  MotionPrior motion;
  motion.relative.emplace();
  motion.relative->now_from_before.rotation = now.rotation * before.rotation.transpose();
  motion.relative->has_translation = false;
  for (std::size_t k = 0; k < 6; ++k) motion.relative->covariance[7 * k] = kSigma * kSigma;
  return motion;
}

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
            const Eigen::Vector3d error =
                LogRotation(frame.pose.rotation * first.cam_from_world.rotation.transpose());
            const Eigen::Matrix3d covariance = first.Covariance().topLeftCorner<3, 3>();
            if (trajectory.pencil) nees += error.dot(covariance.ldlt().solve(error));
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

// A circle of the plane that turns up later carries the pose where the first one is hidden.
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

TEST(PoseTrackerTest, LearnsCirclesAndUsesThem) {
  TrajectoryOptions trajectory;
  trajectory.second_circle = true;
  trajectory.occluded = 0.0;
  trajectory.noise_px = 0.5;
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

// A detector that looks anew may call another axis of the world X: the track goes on.
TEST(PoseTrackerTest, AxesThatAreNamedAnewAreDirectionsLikeOthers) {
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

class OneTrackTest : public testing::Test {
 protected:
  OneTrackTest() : sequence_(Moving(), 20), tracker_(ExactOptions(sequence_.options())) {
    for (int k = 0; k < 10; ++k) last_ = Update(k);
  }
  static TrajectoryOptions Moving() {
    TrajectoryOptions options;
    options.second_circle = options.pencil = true;
    options.occluded = 0.0;
    options.noise_px = 0.5;
    return options;
  }
  Observations Seen(int k) {
    return sequence_.Observe(sequence_.frames[static_cast<std::size_t>(k)], &noise_);
  }
  TrackedPose Update(int k) { return tracker_.Update(Seen(k), k / 30.0); }
  double Error(int k, const PoseHypothesis& h) const {
    return NormalError(sequence_.frames[static_cast<std::size_t>(k)].pose, h);
  }

  Trajectory sequence_;
  Random noise_{21};
  PoseTracker tracker_;
  TrackedPose last_;
};

TEST_F(OneTrackTest, WrongInputIsRefusedInWordsAndChangesNothing) {
  Observations seen = Seen(10);
  EXPECT_EQ(tracker_.Update(seen, 8 / 30.0).estimate.status.code, StatusCode::kInvalidArgument);
  EXPECT_EQ(tracker_.Update(seen, kNaN).estimate.status.code, StatusCode::kInvalidArgument);
  MotionPrior motion;
  motion.relative.emplace();  // No covariance.
  EXPECT_EQ(tracker_.Update(seen, 10 / 30.0, motion).estimate.status.code,
            StatusCode::kInvalidArgument);
  seen.circles[0].points[3].x() = kNaN;
  const TrackedPose refused = tracker_.Update(seen, 10 / 30.0);
  EXPECT_EQ(refused.estimate.status.code, StatusCode::kInvalidArgument);
  EXPECT_NE(refused.estimate.status.message.find("c0"), std::string::npos);
  const TrackedPose next = Update(10);
  EXPECT_TRUE(next.estimate.status.ok());
  EXPECT_EQ(next.frames_since_start, last_.frames_since_start + 1);
  EXPECT_LT(Error(10, next.estimate.hypotheses.front()), 0.05);

  TrackerOptions options;
  options.flip_odds = 0.5;
  const TrackedPose unusable = PoseTracker(options).Update(Seen(0), 0.0);
  EXPECT_EQ(unusable.estimate.status.code, StatusCode::kInvalidArgument);
  EXPECT_NE(unusable.estimate.status.message.find("flip_odds"), std::string::npos);
}

TEST_F(OneTrackTest, EmptyFramesArePredictedAndSaidToBe) {
  Observations empty;
  empty.camera = sequence_.camera;
  for (int k = 10; k < 15; ++k) {
    const TrackedPose tracked = tracker_.Update(empty, k / 30.0);
    ASSERT_TRUE(tracked.estimate.status.ok());
    EXPECT_FALSE(tracked.estimate.status.message.empty());
    EXPECT_TRUE(tracked.predicted_only);
    EXPECT_LT(Error(k, tracked.estimate.hypotheses.front()), 0.1);
  }
  EXPECT_FALSE(Update(15).predicted_only);
  // For longer than max_gap_s: lost.
  EXPECT_FALSE(tracker_.Update(empty, 5.0).estimate.status.ok());
  EXPECT_TRUE(tracker_.Update(Seen(15), 5.1).reinitialized);
  PoseTracker fresh;
  EXPECT_EQ(fresh.Update(empty, 0.0).estimate.status.code, StatusCode::kRefused);
}

TEST_F(OneTrackTest, ACutStartsAnew) {
  const Trajectory other(sequence_.options(), 77);
  int restarts = 0;
  for (int k = 10; k < 30; ++k) {
    const Trajectory::Frame& frame = other.frames[static_cast<std::size_t>(k)];
    const TrackedPose tracked = tracker_.Update(other.Observe(frame, &noise_), k / 30.0);
    ASSERT_TRUE(tracked.estimate.status.ok());
    restarts += tracked.reinitialized ? 1 : 0;
    if (k < 20) continue;
    EXPECT_FALSE(tracked.predicted_only);
    EXPECT_LT(NormalError(frame.pose, tracked.estimate.hypotheses.front()), 0.05);
  }
  EXPECT_EQ(restarts, 1);
}

TEST_F(OneTrackTest, APhotoOfAnotherSizeIsNoLoss) {
  Observations seen = Seen(10);
  Camera& camera = seen.camera;
  camera.width /= 2;
  camera.height /= 2;
  camera.fx *= 0.5;
  camera.fy *= 0.5;
  camera.cx = 0.5 * (camera.cx - 0.5);
  camera.cy = 0.5 * (camera.cy - 0.5);
  const auto halve = [](Eigen::Vector2d* p) { *p = 0.5 * (*p - Eigen::Vector2d(0.5, 0.5)); };
  for (CircleObservation& circle : seen.circles) {
    circle.sigma_px *= 0.5;
    for (Eigen::Vector2d& p : circle.points) halve(&p);
  }
  for (LineObservation& line : seen.pencils[0].lines) {
    for (Eigen::Vector2d& p : line.points) halve(&p);
  }
  seen.pencils[0].sigma_px *= 0.5;
  const TrackedPose tracked = tracker_.Update(seen, 10 / 30.0);
  EXPECT_FALSE(tracked.predicted_only);
  EXPECT_FALSE(tracked.reinitialized);
  EXPECT_LT(Error(10, tracked.estimate.hypotheses.front()), 0.05);
}

TEST_F(OneTrackTest, PredictsWhereToLook) {
  const std::optional<PoseHypothesis> predicted = tracker_.Predict(10 / 30.0);
  ASSERT_TRUE(predicted);
  EXPECT_LT(Error(10, *predicted), 0.05);
  ASSERT_EQ(predicted->circles.size(), 2U);
  const Eigen::Vector2d center = sequence_.Pixel(
      sequence_.frames[10].pose, sequence_.Circles()[1].x, sequence_.Circles()[1].y);
  EXPECT_LT((predicted->circles[1].center_px - center).norm(), 10.0);
  EXPECT_FALSE(tracker_.Predict(0.0));
  for (const double beyond_the_gap : {1000.0, 1e160})
    EXPECT_FALSE(tracker_.Predict(beyond_the_gap));
  tracker_.Reset();
  EXPECT_FALSE(tracker_.Predict(1.0));
  EXPECT_TRUE(Update(0).reinitialized);  // Earlier times are new ones.
}

TEST_F(OneTrackTest, ARelativeMotionTakesTime) {
  const CameraPose& pose = sequence_.frames[9].pose;
  const TrackedPose tracked = tracker_.Update(Seen(9), 9 / 30.0, Gyroscope(pose, pose));
  EXPECT_EQ(tracked.estimate.status.code, StatusCode::kInvalidArgument);
  EXPECT_TRUE(Update(10).estimate.status.ok());
}

TEST_F(OneTrackTest, WhatIsKnownOfThePoseCounts) {
  const TrackedPose plain = Update(10);
  MotionPrior motion;
  motion.absolute.emplace();
  motion.absolute->mean = plain.estimate.hypotheses.front().cam_from_world;
  constexpr double kSigma = 1e-5;
  for (std::size_t k = 0; k < 6; ++k) motion.absolute->covariance[7 * k] = kSigma * kSigma;
  const TrackedPose known = tracker_.Update(Seen(10), 10 / 30.0, motion);
  EXPECT_LT(known.estimate.hypotheses.front().SigmaRotation().maxCoeff(), 1.1 * kSigma);
  MotionPrior gravity;
  gravity.gravity.emplace();
  gravity.gravity->in_camera = sequence_.frames[11].pose.rotation.col(2);
  gravity.gravity->sigma_rad = kSigma;
  const TrackedPose upright = tracker_.Update(Seen(11), 11 / 30.0, gravity);
  EXPECT_LT(Error(11, upright.estimate.hypotheses.front()), 10.0 * kSigma);
}

// Also where the frame says nothing and what is known of the motion contradicts.
TEST_F(OneTrackTest, ProbabilitiesSumToOne) {
  Observations empty;
  empty.camera = sequence_.camera;
  MotionPrior motion;
  motion.gravity.emplace();
  motion.gravity->in_camera = sequence_.frames[10].pose.rotation * Eigen::Vector3d::UnitX();
  const TrackedPose tracked = tracker_.Update(empty, 10 / 30.0, motion);
  double sum = 0.0;
  for (const PoseHypothesis& h : tracked.estimate.hypotheses) sum += h.probability;
  EXPECT_NEAR(sum, 1.0, 1e-9);
}

TEST_F(OneTrackTest, SameInputSameBits) {
  Trajectory again(Moving(), 20);
  PoseTracker tracker(ExactOptions(again.options()));
  Random noise(21);
  TrackedPose last;
  for (int k = 0; k < 10; ++k)
    last =
        tracker.Update(again.Observe(again.frames[static_cast<std::size_t>(k)], &noise), k / 30.0);
  ASSERT_EQ(last.estimate.hypotheses.size(), last_.estimate.hypotheses.size());
  EXPECT_EQ(last.estimate.hypotheses[0].cam_from_world.rotation,
            last_.estimate.hypotheses[0].cam_from_world.rotation);
  EXPECT_EQ(last.estimate.hypotheses[0].covariance, last_.estimate.hypotheses[0].covariance);
}

}  // namespace
}  // namespace circline
