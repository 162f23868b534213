#include "circline/refine/pose_tracker.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "circline/estimators/point_noise.h"
#include "circline/estimators/statistics.h"
#include "circline/refine/joint/readings.h"
#include "circline/refine/track/scratch.h"
#include "circline/refine/track/track_frame.h"
#include "circline/refine/track/track_state.h"
#include "circline/refine/track/track_steps.h"

namespace circline {

class PoseTracker::Implementation {
 public:
  explicit Implementation(const TrackerOptions& options)
      : options_(options), options_status_(options.Validate()), frame_(options_, map_) {}

  void Update(const Observations& observations, double time, const MotionPrior& motion,
              TrackedPose* tracked) {
    // What a caller's TrackedPose has is of no account, but for its memory.
    tracked->timestamp_s = time;
    tracked->reinitialized = tracked->relocalized = tracked->predicted_only = false;
    tracked->frames_since_start = 0;
    PoseEstimate& estimate = tracked->estimate;
    estimate.status = Validate(observations, time, motion);
    estimate.solver = "tracker";
    estimate.decided_by.clear();
    estimate.notes.clear();
    if (!estimate.status.ok()) {
      estimate.hypotheses.clear();
      return;
    }
    const double dt = hypotheses_.empty() ? 0.0 : time - time_;
    time_ = time;
    Prepare(observations);
    if (hypotheses_.empty() || time - used_ > options_.max_gap_s) {
      Start(observations, tracked);
      return;
    }
    Move(dt, motion);
    if (hypotheses_.empty()) {
      Start(observations, tracked);
      estimate.notes.emplace_back("the motion left the range of numbers: the track starts anew");
      return;
    }
    if (Refine()) {
      if (!StartWhereTold(observations, tracked)) Use(tracked);
    } else {
      Predicted(observations, tracked);
    }
  }

  std::optional<PoseHypothesis> Predict(double time) const {
    // Beyond the gap the next frame begins anew: nothing is expected.
    if (hypotheses_.empty() || !(time >= time_) || !(time - used_ <= options_.max_gap_s)) return {};
    TrackState state = hypotheses_[0].state;
    MoveOn(map_, options_, time - time_, &state);
    PoseHypothesis h;
    FillHypothesis(map_, state, fitted_.camera, &h);
    return h;
  }

  void Reset() {
    hypotheses_.Shorten(0);
    time_ = used_ = -std::numeric_limits<double>::infinity();
    contradictions_ = frames_ = 0;
  }

 private:
  Status Validate(const Observations& observations, double time, const MotionPrior& motion) const {
    if (!options_status_.ok()) return options_status_;
    if (!std::isfinite(time)) return Status::Invalid("the time must be finite");
    if (time < time_) return Status::Invalid("the time must not be before that of the last call");
    Status status = motion.Validate();
    if (status.ok()) status = observations.Validate();
    if (status.ok() && !hypotheses_.empty() && motion.relative && !(time > time_))
      status = Status::Invalid("a relative motion takes time: give a later one");
    return status;
  }

  void Prepare(const Observations& observations) {
    fitted_ = observations;
    problems_.clear();
    const EstimationOptions& estimation = options_.estimation;
    FitDirect(FitSigmaPx(estimation), &fitted_, &problems_, NoiseModel::Exact(), &fit_memory_);
    noise_meter_.Measure(fitted_, estimation.noise_model, &noise_);
    StateNoise(noise_, estimation.conic_loss.scale_px, estimation.line_loss.scale_px, &fitted_);
    news_ = frame_news_.Next(fitted_, estimation.noise_model);
  }

  // Begins a track with the poses of a single frame; the track before ends where there are any.
  void Start(const Observations& observations, TrackedPose* tracked) {
    PoseEstimate& estimate = tracked->estimate;
    estimate = EstimatePose(observations, options_.estimation);
    estimate.solver = "tracker";
    if (!estimate.status.ok() || Relocalize(tracked)) return;
    if (!hypotheses_.empty()) estimate.notes.emplace_back("the track was lost and starts anew");
    StartWith(tracked);
  }

  // The same with the poses that `tracked` has of this frame.
  void StartWith(TrackedPose* tracked) {
    const PoseEstimate& estimate = tracked->estimate;
    tracked->reinitialized = true;
    num_strange_ = 0;
    looked_at_ = time_;
    contradictions_ = frames_ = 0;
    used_ = time_;
    const Observations resolved = ResolveWorld(fitted_);
    StartMap(resolved, estimate.hypotheses, options_, &map_, &fits_);
    frame_.Reset(resolved);
    hypotheses_.Shorten(0);
    for (std::size_t i = 0; i < fits_.size(); ++i) {
      const TrackState& start = fits_[i].state;
      const double log_focal = std::log(estimate.hypotheses[i].focal_scale);
      if (!start.IsInRange() ||
          !frame_.RefineFrom(start, start.Pose(map_), log_focal, &hypotheses_)) {
        continue;
      }
      TrackState& state = hypotheses_[hypotheses_.size() - 1].state;
      ConditionOnPriors(&state);
      state.log_weight = start.log_weight;  // Its evidence has been counted.
    }
    // What cannot be refined here cannot be carried on; the frame's answer stands.
    if (!hypotheses_.empty()) Rank(options_, &hypotheses_);
    if (fitted_.frame.plane.empty()) map_.plane = NamedPlane(fitted_, map_.plane);
  }

  // What the track lacks, a later frame may tell by itself. False where this one does not.
  bool StartWhereTold(const Observations& observations, TrackedPose* tracked) {
    if (!LacksSomething(map_, hypotheses_[0].state)) return false;
    constexpr double kOtherSide_s = 1.0;  // After so long a look is worth its time.
    const int num_strange = NumStrange(fitted_, map_);
    const bool is_other = num_strange > num_strange_ || time_ - looked_at_ >= kOtherSide_s;
    num_strange_ = num_strange;
    if (!is_other) return false;
    looked_at_ = time_;
    TrackedPose anew = *tracked;
    anew.estimate = EstimatePose(observations, options_.estimation);
    anew.estimate.solver = "tracker";
    if (!anew.estimate.status.ok()) return false;
    const std::string told =
        WhatIsTold(anew.estimate.hypotheses.front(), map_, hypotheses_[0].state);
    if (told.empty()) return false;
    *tracked = std::move(anew);
    tracked->estimate.notes.push_back(told + ": the track starts anew");
    StartWith(tracked);
    return true;
  }

  // Goes on in the known map, where the frame, whose own poses `tracked` has, shows some of it and
  // agrees with the rest.
  bool Relocalize(TrackedPose* tracked) {
    fits_.Shorten(0);
    frame_.Reset(fitted_);
    for (const TrackState& start :
         Relocated(map_, hypotheses_, tracked->estimate.hypotheses, options_)) {
      const double log_focal = start.x[map_.block(TrackMap::kCamera).offset];
      if (frame_.RefineFrom(start, start.Pose(map_), log_focal, &fits_) &&
          !Agrees(fits_[fits_.size() - 1])) {
        fits_.Shorten(fits_.size() - 1);
      }
    }
    if (fits_.empty()) return false;
    Merge(map_, &fits_);
    TakeFits();
    tracked->relocalized = true;
    Use(tracked);
    tracked->estimate.notes.emplace_back("the track was lost, and is back in its world");
    return true;
  }

  bool Agrees(const TrackFit& fit) const {
    return fit.misfit <= ChiSquareLimit(std::max(1, fit.dof), options_.gate_probability);
  }

  // The frame's part is in the hypotheses.
  void Use(TrackedPose* tracked) {
    contradictions_ = 0;
    used_ = time_;
    tracked->frames_since_start = ++frames_;
    Answer(true, tracked);
    ExtendMap(fitted_, options_, &map_, &hypotheses_);
  }

  // What is known of the first pose counts in those that follow.
  void ConditionOnPriors(TrackState* state) {
    const EstimationOptions& known = options_.estimation;
    if (known.pose_prior) {
      PosePrior prior = *known.pose_prior;
      if (!map_.metric || !map_.origin_observed) {  // t has no part in it.
        constexpr double kNothing = 1e6;            // Standard deviation that says nothing.
        Eigen::Map<Matrix6d> P(prior.covariance.data());
        P.topRightCorner<3, 3>().setZero();
        P.bottomLeftCorner<3, 3>().setZero();
        P.bottomRightCorner<3, 3>() = kNothing * kNothing * Eigen::Matrix3d::Identity();
      }
      Condition(map_, prior, &scratch_, state);
    }
    if (known.gravity_prior) Condition(map_, *known.gravity_prior, &scratch_, state);
  }

  // The name of the world's plane if the caller gave it, else none: a conventional name means
  // another plane in the next frame.
  static std::string NamedPlane(const Observations& given, const std::string& plane) {
    const auto has = [&](const auto& features) {
      return std::any_of(features.begin(), features.end(),
                         [&](const auto& feature) { return feature.plane == plane; });
    };
    return has(given.circles) || has(given.pencils) ? plane : std::string();
  }

  // Keeps the states that numbers can hold.
  void Move(double dt, const MotionPrior& motion) {
    std::size_t kept = 0;
    for (TrackFit& hypothesis : hypotheses_) {
      TrackState& state = hypothesis.state;
      if (motion.relative) {
        MoveBy(map_, options_, *motion.relative, dt, &state);
      } else {
        MoveOn(map_, options_, dt, &state);
      }
      if (motion.absolute) Condition(map_, *motion.absolute, &scratch_, &state);
      if (motion.gravity) Condition(map_, *motion.gravity, &scratch_, &state);
      if (state.IsInRange()) std::swap(hypotheses_[kept++], hypothesis);
    }
    hypotheses_.Shorten(kept);
    if (kept > 0) Rank(options_, &hypotheses_);  // For a frame without more.
  }

  // False, the hypotheses as they were, where the frame says nothing or contradicts all of them.
  bool Refine() {
    fits_.Shorten(0);
    frame_.Reset(fitted_, news_);
    is_blank_ = frame_.empty();
    if (is_blank_) return false;
    for (const TrackFit& hypothesis : hypotheses_) {
      frame_.Refine(hypothesis.state, &fits_);
    }
    if (std::none_of(fits_.begin(), fits_.end(),
                     [&](const TrackFit& fit) { return Agrees(fit); })) {
      return false;
    }
    Merge(map_, &fits_);
    TakeFits();
    return true;
  }

  // In place of the hypotheses before.
  void TakeFits() {
    Rank(options_, &fits_);
    std::swap(hypotheses_, fits_);
  }

  // `with_frame`: which has a part in the hypotheses.
  void Answer(bool with_frame, TrackedPose* tracked) {
    PoseEstimate& estimate = tracked->estimate;
    estimate.notes = problems_;
    estimate.hypotheses.resize(hypotheses_.size());
    for (std::size_t i = 0; i < hypotheses_.size(); ++i) {
      PoseHypothesis& h = estimate.hypotheses[i];
      FillHypothesis(map_, hypotheses_[i].state, fitted_.camera, &h);
      if (with_frame)
        FillFrame(frame_, hypotheses_[i], &h, i == 0 ? &estimate.notes : nullptr, &distances_);
    }
    DecidedByFrames(estimate.hypotheses, &estimate.decided_by);
  }

  void Predicted(const Observations& observations, TrackedPose* tracked) {
    // Features that are all new are another world, as far as anybody knows.
    const bool says_something = !is_blank_ || !fitted_.circles.empty() || !fitted_.pencils.empty();
    if (says_something && ++contradictions_ >= options_.lost_after) {
      TrackedPose anew = *tracked;
      Start(observations, &anew);
      if (anew.estimate.status.ok()) {
        *tracked = std::move(anew);
        return;
      }
    }
    tracked->predicted_only = true;
    tracked->frames_since_start = ++frames_;
    Answer(false, tracked);
    tracked->estimate.status.message =
        is_blank_ ? "nothing of the map is seen in this frame: the pose is predicted"
                  : "the frame contradicts all hypotheses: the pose is predicted without it";
  }

  TrackerOptions options_;
  Status options_status_;
  TrackMap map_;
  Kept<TrackFit> hypotheses_;
  double time_ = -std::numeric_limits<double>::infinity(), used_ = time_;  // Seconds.
  int contradictions_ = 0, frames_ = 0;
  // Where the focal length is not told: of the last frame (NumStrange); when it was looked for.
  int num_strange_ = 0;
  double looked_at_ = 0.0;  // Seconds.
  // Of the present frame; kept for their memory.
  Observations fitted_;
  FitMemory fit_memory_;
  PointNoiseMeter noise_meter_;
  PointNoise noise_;
  FrameNews frame_news_;
  double news_ = 1.0;
  std::vector<std::string> problems_;
  TrackFrame frame_;
  Kept<TrackFit> fits_;
  bool is_blank_ = false;
  Scratch scratch_;
  std::vector<double> distances_;
};

PoseTracker::PoseTracker(const TrackerOptions& options)
    : implementation_(std::make_unique<Implementation>(options)) {}
PoseTracker::~PoseTracker() = default;
PoseTracker::PoseTracker(PoseTracker&&) noexcept = default;
PoseTracker& PoseTracker::operator=(PoseTracker&&) noexcept = default;

TrackedPose PoseTracker::Update(const Observations& observations, double timestamp_s) {
  return Update(observations, timestamp_s, MotionPrior());
}

TrackedPose PoseTracker::Update(const Observations& observations, double timestamp_s,
                                const MotionPrior& motion) {
  TrackedPose tracked;
  implementation_->Update(observations, timestamp_s, motion, &tracked);
  return tracked;
}

void PoseTracker::Update(const Observations& observations, double timestamp_s,
                         const MotionPrior& motion, TrackedPose* tracked) {
  implementation_->Update(observations, timestamp_s, motion, tracked);
}

std::optional<PoseHypothesis> PoseTracker::Predict(double timestamp_s) const {
  return implementation_->Predict(timestamp_s);
}

void PoseTracker::Reset() { implementation_->Reset(); }

}  // namespace circline
