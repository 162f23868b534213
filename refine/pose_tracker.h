// Poses of a camera that moves, or of a thing that moves before it, frame after frame: what
// EstimatePose says of one photo, carried on in time.
//
//     PoseTracker tracker(options);
//     for (const Frame& frame : frames) {
//       const TrackedPose tracked = tracker.Update(frame.observations, frame.seconds);
//       if (!tracked.estimate.status.ok()) continue;  // Its message says why.
//       Use(tracked.estimate.hypotheses.front());     // Best first; probabilities sum to 1.
//     }
//
// What is carried. Several hypotheses, each a Gaussian with a probability: the pose, its velocity,
// and a map of the circles and directions seen so far; and what does not change from frame to frame
// and so does not average out: the error of the camera, and the offset of each contour. One frame's
// posterior is the next one's prior. Each hypothesis is moved on (constant velocity, or what
// the caller knows of the motion), then refined on the frame's points by ceres, and its probability
// multiplied by what the frame says of it (Laplace's approximation of its evidence), and the frame
// before has not said: the errors that points of a contour share stay where the image stays, and a
// camera at rest learns nothing from frame to frame. Of a circle's two poses the wrong one dies
// once perspective, other features or known motion contradict it; where nothing does (one circle,
// weak perspective, unknown motion) both stay, at their probabilities, and the first stays first
// (TrackerOptions::flip_odds).
//
// Features are known again by their ids: a circle or pencil with the id of an earlier frame is the
// same thing in the world. A feature without a part in the map yet is added to it. Circles of other
// planes than the world's take no part, as in EstimatePose.
//
// The world frame is that of the first frame (EstimatePose; docs/conventions.md) and stays: what
// later frames say of FrameObservation::origin, known angles and known lengths is not used. A turn
// about the normal that nothing fixes is zero in the first frame and then follows the motion. That
// a new pencil runs along X, Y or Z counts in frames that have a known one along its axis. Unit:
// that of the first frame's pose; where that is not metric, the distance of its origin, so that
// later translations have other lengths than 1 though `metric` is false. Without any circle only
// the rotation is tracked, and the translation stays that of the first frame; one that has a
// circle in its world's plane, and a pose with a probability of 0.9 or more, starts the track anew
// (`reinitialized`, with a note). So does one that shows new features where the normal of the
// world's plane has become vague, 5 degrees, and tells its own twice as well.
//
// Camera. One that is an unknown (CameraSigma::IsEstimated) is refined from frame to frame once a
// frame by itself tells the focal length to 5 %. Before, what many frames tell of it, each a
// little, is not counted: the focal length, and its sigma, are those of the first frame, and the
// poses' covariances count them. A frame that tells it twice as well by itself, looked for once a
// second and where new features come, starts the track anew (`reinitialized`, with a note).
//
// Loss. A frame that contradicts all hypotheses, or has nothing of the map but other features, is
// not used (predicted_only). After TrackerOptions::lost_after of them in a row, or a gap longer
// than max_gap_s, the track is lost. A frame with circles of the map, by their ids, that agrees
// with it brings it back into the same world (`relocalized`), however long the gap was; any other
// one with a pose starts it anew, with a new world (`reinitialized`). A single circle of unknown
// radius contradicts no map: its id is then believed, the unit is that of its radius in the map,
// and its turn about its normal, unless a direction of the map is seen too, starts anew as free.
//
// Errors are statuses. Wrong input (a time that is not finite or runs backwards, observations or
// options that do not pass their Validate) is refused in words and changes nothing. A frame without
// evidence gives the predicted pose, predicted_only, and a message that says so.
//
// Memory. Nothing is allocated but by ceres::Problem and ceres::Solve in a frame that has no more
// features, points and hypotheses than frames before, where the answer goes into a TrackedPose that
// is kept from frame to frame. What does allocate: an answer that is returned by value; Predict;
// first frames, and features that are new to the map; what is said in words (notes, a status that
// is not ok); an axis that is drawn apart from the lines; ids and names beyond 15 characters in an
// answer that has not had them.
//
// Cost: bounded by TrackerOptions::max_hypotheses and max_evaluations
// (`circline_benchmark --benchmark_filter=Tracker`). Not thread-safe: one tracker a thread; several
// trackers share nothing.
#ifndef CIRCLINE_REFINE_POSE_TRACKER_H_
#define CIRCLINE_REFINE_POSE_TRACKER_H_

#include <array>
#include <memory>
#include <optional>

#include "circline/estimators/export.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/status.h"
#include "circline/refine/estimate_pose.h"

namespace CIRCLINE_EXPORT circline {

// How a PoseTracker weighs, and what it expects of the motion.
struct TrackerOptions {
  // Losses, noise model and camera, as for a single photo. Its pose_prior, gravity_prior and prior
  // count in first frames only; max_iterations too.
  EstimationOptions estimation;

  // How far velocities change within a second: standard deviations of a random walk, > 0. The
  // velocity is that of the world in the camera frame: a turn, radians per second, and a shift, in
  // distances of the world's origin per second. The defaults are those of a camera in a hand.
  double turn_rate_sigma = 1.0;  // rad/s within a second.
  double velocity_sigma = 0.5;   // Distances/s within a second.
  // Of the velocities before anything is known of them.
  double initial_turn_rate_sigma = 0.5;  // rad/s.
  double initial_velocity_sigma = 0.3;   // Distances/s.

  // Hypotheses less probable than this are dropped, and those beyond this number.
  double min_probability = 1e-6;
  int max_hypotheses = 8;
  // The first hypothesis stays first until another one is so many times as probable; 1 or more.
  double flip_odds = 2.0;
  // A frame contradicts a hypothesis where its misfit would be exceeded with this probability.
  double gate_probability = 1e-7;
  int lost_after = 3;      // Frames in a row that contradict all hypotheses; 1 or more.
  double max_gap_s = 1.0;  // Seconds without evidence that can be used.
  // Evaluations of the evidence (with derivatives) from one start; a hypothesis has two at most.
  int max_evaluations = 20;

  // Ok, or a sentence that names the field which is wrong.
  Status Validate() const;
};

// How the camera has moved since the last call: X_now = rotation * X_before + translation, camera
// frames; from odometry or an IMU. The covariance is of [delta, delta_t], 6x6 row-major as
// PoseHypothesis::covariance; positive definite.
struct RelativePose {
  // None by default.
  CameraPose now_from_before = {Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()};
  std::array<double, 36> covariance{};  // Of it; must be given.
  // Whether the translation is in the unit of the tracked poses (that of a metric map). Otherwise
  // it is not used, and the shift follows the constant velocity.
  bool has_translation = true;
};

// What is known of one frame's pose besides its pixels.
struct MotionPrior {
  std::optional<RelativePose> relative;  // Takes the place of the constant velocity.
  std::optional<PosePrior> absolute;     // In the tracker's world frame.
  std::optional<GravityPrior> gravity;   // in_world: in the tracker's world frame.

  // Ok, or a sentence that names the field which is wrong.
  Status Validate() const;
};

// What Update returns.
struct TrackedPose {
  // As EstimatePose's, but for the unit of translations (see above). Covariances and probabilities
  // are those of all frames so far. `status` not ok: no hypotheses, and why; ok with a message: the
  // frame has no part in the pose, and why.
  PoseEstimate estimate;
  double timestamp_s = 0.0;     // As given to Update, seconds.
  bool reinitialized = false;   // The track starts with this frame, with a world frame of its own.
  bool relocalized = false;     // Lost before this frame, and found again in the same world.
  bool predicted_only = false;  // Moved on from earlier frames; this one has no part in it.
  int frames_since_start = 0;   // 0 for the one with which the track starts.
};

// Carries poses from frame to frame, as the top of this file says.
class PoseTracker {
 public:
  // Nothing is tracked yet.
  explicit PoseTracker(const TrackerOptions& options = {});
  ~PoseTracker();
  // Moves; what was moved from may only be assigned to or destroyed.
  PoseTracker(PoseTracker&&) noexcept;
  PoseTracker& operator=(PoseTracker&&) noexcept;

  // The pose at `timestamp_s`, seconds, not before that of the last call. Never throws, never
  // returns NaN.
  TrackedPose Update(const Observations& observations, double timestamp_s);
  TrackedPose Update(const Observations& observations, double timestamp_s,
                     const MotionPrior& motion);
  // The same into the caller's answer, in the memory that it has.
  void Update(const Observations& observations, double timestamp_s, const MotionPrior& motion,
              TrackedPose* tracked);

  // The best hypothesis moved on to that time, with the circles of the map (camera frame) and its
  // directions: where a detector may look. None where nothing is tracked, the time is before the
  // last one, or so late that the next frame will begin anew (max_gap_s). Changes nothing.
  std::optional<PoseHypothesis> Predict(double timestamp_s) const;

  // Forgets everything but the options.
  void Reset();

 private:
  class Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_POSE_TRACKER_H_
