// What a tracker makes of what it is given: wrong and empty frames, cuts, priors, times.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "apps/benchmark/trajectory.h"
#include "tests/basics.h"

namespace circline {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

// Root of the sum of those variances of [delta, delta_t].
double Deviation(const PoseHypothesis& h, const std::array<int, 3>& rows) {
  double sum = 0.0;
  for (const int k : rows) sum += h.Covariance()(k, k);
  return std::sqrt(sum);
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
  EXPECT_CONTAINS(refused.estimate.status.message, "c0");
  const TrackedPose next = Update(10);
  EXPECT_TRUE(next.estimate.status.ok());
  EXPECT_EQ(next.frames_since_start, last_.frames_since_start + 1);
  EXPECT_LT(Error(10, next.estimate.hypotheses.front()), 0.05);

  TrackerOptions options;
  options.flip_odds = 0.5;
  const TrackedPose unusable = PoseTracker(options).Update(Seen(0), 0.0);
  EXPECT_EQ(unusable.estimate.status.code, StatusCode::kInvalidArgument);
  EXPECT_CONTAINS(unusable.estimate.status.message, "flip_odds");
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
  const TrackedPose back = tracker_.Update(Seen(15), 5.1);
  EXPECT_TRUE(back.relocalized);
  EXPECT_LT(Error(15, back.estimate.hypotheses.front()), 0.05);
  PoseTracker fresh;
  EXPECT_EQ(fresh.Update(empty, 0.0).estimate.status.code, StatusCode::kRefused);
}

// The same circles from elsewhere: the pose comes back in the same world and unit.
TEST_F(OneTrackTest, AfterACutThePoseComesBackInItsWorld) {
  const Trajectory other(sequence_.options(), 77);
  const PoseHypothesis& before = last_.estimate.hypotheses.front();
  const double unit =
      before.cam_from_world.translation.norm() / sequence_.frames[9].pose.translation.norm();
  // The unit is known as well as the pose is that it is taken from.
  const double unit_sigma = Deviation(before, {3, 4, 5}) / before.cam_from_world.translation.norm();
  int restarts = 0, returns = 0;
  for (int k = 10; k < 30; ++k) {
    const Trajectory::Frame& frame = other.frames[static_cast<std::size_t>(k)];
    const TrackedPose tracked = tracker_.Update(other.Observe(frame, &noise_), k / 30.0);
    ASSERT_TRUE(tracked.estimate.status.ok());
    restarts += tracked.reinitialized ? 1 : 0;
    returns += tracked.relocalized ? 1 : 0;
    if (k < 20) continue;
    EXPECT_FALSE(tracked.predicted_only);
    const PoseHypothesis& first = tracked.estimate.hypotheses.front();
    // Turn and place, too: those of the world before.
    constexpr double kSigmas = 4.0;
    EXPECT_LT(RotationError(frame.pose, first), kSigmas * Deviation(first, {0, 1, 2})) << k;
    EXPECT_LT((first.cam_from_world.translation - unit * frame.pose.translation).norm(),
              kSigmas * std::hypot(Deviation(first, {3, 4, 5}),
                                   unit_sigma * first.cam_from_world.translation.norm()))
        << k;
  }
  EXPECT_EQ(restarts, 0);
  EXPECT_EQ(returns, 1);
}

// Other circles under the ids of the map, or of no id that it has: another world.
TEST_F(OneTrackTest, ACutToAnotherWorldStartsAnew) {
  for (const bool same_ids : {true, false}) {
    PoseTracker tracker(ExactOptions(sequence_.options()));
    for (int k = 0; k < 10; ++k) tracker.Update(Seen(k), k / 30.0);
    int restarts = 0;
    const Trajectory other(sequence_.options(), 77);
    for (int k = 10; k < 20; ++k) {
      Observations seen = other.Observe(other.frames[static_cast<std::size_t>(k)], &noise_);
      if (same_ids) {
        std::swap(seen.circles[0].id, seen.circles[1].id);  // Of other sizes.
      } else {
        for (CircleObservation& circle : seen.circles) circle.id += " of elsewhere";
        for (PencilObservation& pencil : seen.pencils) pencil.id += " of elsewhere";
      }
      restarts += tracker.Update(seen, k / 30.0).reinitialized ? 1 : 0;
    }
    EXPECT_EQ(restarts, 1) << same_ids;
  }
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

TEST_F(OneTrackTest, ARelativeMotionInNearlyNoTimeStaysFinite) {
  const CameraPose &from = sequence_.frames[0].pose, &to = sequence_.frames[1].pose;
  PoseTracker tracker(ExactOptions(sequence_.options()));
  ASSERT_TRUE(tracker.Update(Seen(0), 0.0).estimate.status.ok());
  for (const double time : {1e-170, 2e-170, 0.1}) {
    const TrackedPose tracked = tracker.Update(Seen(1), time, Gyroscope(from, to));
    ASSERT_FALSE(tracked.estimate.hypotheses.empty()) << tracked.estimate.status.message;
    for (const PoseHypothesis& h : tracked.estimate.hypotheses)
      EXPECT_TRUE(h.Covariance().allFinite()) << time;
  }
}

TEST_F(OneTrackTest, AMotionBeyondNumbersStartsAnew) {
  const CameraPose &from = sequence_.frames[0].pose, &to = sequence_.frames[1].pose;
  for (const double far : {1e90, 1e200, -1e305}) {
    PoseTracker tracker(ExactOptions(sequence_.options()));
    ASSERT_TRUE(tracker.Update(Seen(0), 0.0).estimate.status.ok());
    MotionPrior motion = Gyroscope(from, to);
    motion.relative->has_translation = true;
    motion.relative->now_from_before.translation.x() = far;
    const TrackedPose tracked = tracker.Update(Seen(1), 0.1, motion);
    EXPECT_TRUE(tracked.reinitialized) << far;
    ASSERT_FALSE(tracked.estimate.hypotheses.empty()) << tracked.estimate.status.message;
    const PoseHypothesis& h = tracked.estimate.hypotheses.front();
    EXPECT_TRUE(h.Covariance().allFinite() && h.cam_from_world.translation.allFinite()) << far;
  }
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
