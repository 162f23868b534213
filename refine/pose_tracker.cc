#include "circline/refine/pose_tracker.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "circline/estimators/point_noise.h"
#include "circline/refine/chi_square.h"
#include "circline/refine/scratch.h"
#include "circline/refine/track_frame.h"
#include "circline/refine/track_map.h"
#include "circline/refine/track_ranking.h"
#include "circline/refine/track_relocate.h"
#include "circline/refine/track_result.h"
#include "circline/refine/track_state.h"

namespace circline {

class PoseTracker::Implementation {
 public:
  explicit Implementation(const TrackerOptions& options)
      : options_(options), options_status_(options.Validate()), frame_(options_.estimation, map_) {}

  void Update(const Observations& observations, double time, const MotionPrior& motion,
              TrackedPose* tracked) {
    const Status status = Validate(observations, time, motion);
    Begin(time, status, tracked);
    if (!status.ok()) {
      tracked->estimate.hypotheses.clear();
      return;
    }
    const double dt = states_.empty() ? 0.0 : time - time_;
    time_ = time;
    Prepare(observations);
    if (states_.empty() || time - used_ > options_.max_gap_s) {
      Start(observations, tracked);
      return;
    }
    Move(dt, motion);
    if (states_.empty()) {
      Start(observations, tracked);
      tracked->estimate.notes.emplace_back(
          "the motion left the range of numbers: the track starts anew");
      return;
    }
    Refine();
    if (fits_.empty()) {
      Predicted(observations, tracked);
      return;
    }
    Use(tracked);
  }

  std::optional<PoseHypothesis> Predict(double time) const {
    // Beyond the gap the next frame begins anew: nothing is expected.
    if (states_.empty() || !(time >= time_) || !(time - used_ <= options_.max_gap_s)) return {};
    TrackState state = states_.front();
    MoveOn(map_, options_, time - time_, &state);
    PoseHypothesis h;
    FillHypothesis(map_, state, fitted_.camera, &h);
    return h;
  }

  void Reset() {
    spare_states_.Resize(0, &states_);
    time_ = used_ = -std::numeric_limits<double>::infinity();
    contradictions_ = frames_ = 0;
  }

  const TrackerOptions& options() const { return options_; }

 private:
  Status Validate(const Observations& observations, double time, const MotionPrior& motion) const {
    if (!options_status_.ok()) return options_status_;
    if (!std::isfinite(time)) return Status::Invalid("the time must be finite");
    if (time < time_) return Status::Invalid("the time must not be before that of the last call");
    Status status = motion.Validate();
    if (status.ok()) status = observations.Validate();
    if (status.ok() && !states_.empty() && motion.relative && !(time > time_))
      status = Status::Invalid("a relative motion takes time: give a later one");
    return status;
  }

  // What a caller's TrackedPose has is of no account, but for its memory.
  static void Begin(double time, const Status& status, TrackedPose* tracked) {
    tracked->timestamp_s = time;
    tracked->reinitialized = tracked->relocalized = tracked->predicted_only = false;
    tracked->frames_since_start = 0;
    PoseEstimate& estimate = tracked->estimate;
    estimate.status = status;
    estimate.solver = "tracker";
    estimate.decided_by.clear();
    estimate.notes.clear();
  }

  void Prepare(const Observations& observations) {
    constexpr double kDefaultSigmaPx = 0.4;  // For fits that nobody has made yet.
    const double scale = options_.estimation.line_loss.scale_px;
    fitted_ = observations;
    problems_.clear();
    FitDirect(scale > 0.0 ? scale : kDefaultSigmaPx, &fitted_, &problems_, NoiseModel::Exact(),
              &fit_memory_);
    noise_meter_.Measure(fitted_, options_.estimation.noise_model, &noise_);
  }

  // Begins a track with the poses of a single frame; the track before ends where there are any.
  void Start(const Observations& observations, TrackedPose* tracked) {
    PoseEstimate& estimate = tracked->estimate;
    estimate = EstimatePose(observations, options_.estimation);
    estimate.solver = "tracker";
    if (!estimate.status.ok() || Relocalize(tracked)) return;
    if (!states_.empty()) estimate.notes.emplace_back("the track was lost and starts anew");
    tracked->reinitialized = true;
    contradictions_ = frames_ = 0;
    used_ = time_;
    const Observations resolved = ResolveWorld(fitted_);
    StartMap(resolved, estimate.hypotheses, options_, &map_, &states_);
    frame_.Reset(resolved, noise_);
    std::vector<TrackFit> fits;
    for (std::size_t i = 0; i < states_.size(); ++i) {
      const TrackState& state = states_[i];
      const double log_focal = std::log(estimate.hypotheses[i].focal_scale);
      TrackFit fit;
      if (!state.IsInRange() || !frame_.RefineHere(state, log_focal, options_, &fit)) continue;
      ConditionOnPriors(&fit.state);
      fit.state.log_weight = state.log_weight;  // Its evidence has been counted.
      fits.push_back(std::move(fit));
    }
    // What cannot be refined here cannot be carried on; the frame's answer stands.
    if (!fits.empty()) Rank(options_, &frame_.spares, &fits);
    states_.clear();
    for (TrackFit& fit : fits) states_.push_back(std::move(fit.state));
    if (fitted_.frame.plane.empty()) map_.plane = NamedPlane(fitted_, map_.plane);
  }

  // Goes on in the known map, where the frame, whose own poses `tracked` has, shows some of it and
  // agrees with the rest.
  bool Relocalize(TrackedPose* tracked) {
    std::vector<TrackState> starts =
        Relocated(map_, states_, tracked->estimate.hypotheses, options_);
    if (starts.empty()) return false;
    frame_.spares.Resize(0, &fits_);
    frame_.Reset(fitted_, noise_);
    frame_.KeepCheapest(static_cast<std::size_t>(options_.max_hypotheses), &starts);
    for (const TrackState& start : starts) {
      const double log_focal = start.x[map_.block(TrackMap::kCamera).offset];
      TrackFit fit;
      if (frame_.RefineHere(start, log_focal, options_, &fit) && Agrees(fit))
        fits_.push_back(std::move(fit));
    }
    if (fits_.empty()) return false;
    Merge(map_, MergedWeight::kLarger, &frame_.spares, &fits_);
    TakeFits();
    tracked->relocalized = true;
    Use(tracked);
    tracked->estimate.notes.emplace_back("the track was lost, and is back in its world");
    return true;
  }

  bool Agrees(const TrackFit& fit) const {
    return fit.misfit <= ChiSquareLimit(std::max(1, fit.dof), options_.gate_probability);
  }

  // The frame's part is in states_ and fits_.
  void Use(TrackedPose* tracked) {
    contradictions_ = 0;
    used_ = time_;
    tracked->frames_since_start = ++frames_;
    Answer(tracked);
    ExtendMap(fitted_, options_, &map_, &states_);
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
    for (TrackState& state : states_) {
      if (motion.relative) {
        MoveBy(map_, options_, *motion.relative, dt, &state);
      } else {
        MoveOn(map_, options_, dt, &state);
      }
      if (motion.absolute) Condition(map_, *motion.absolute, &scratch_, &state);
      if (motion.gravity) Condition(map_, *motion.gravity, &scratch_, &state);
    }
    states_.erase(std::remove_if(states_.begin(), states_.end(),
                                 [](const TrackState& state) { return !state.IsInRange(); }),
                  states_.end());
    if (!states_.empty()) Rank(options_, &spare_states_, &states_);  // For a frame without more.
  }

  // Fills fits_, ranked; empty where the frame says nothing or contradicts all hypotheses.
  void Refine() {
    frame_.spares.Resize(0, &fits_);
    frame_.Reset(fitted_, noise_);
    is_blank_ = frame_.empty();
    if (is_blank_) return;
    for (const TrackState& state : states_) {
      frame_.spares.Resize(0, &own_fits_);
      frame_.Refine(state, options_, &own_fits_);
      Merge(map_, MergedWeight::kLarger, &frame_.spares, &own_fits_);
      for (TrackFit& fit : own_fits_) fits_.push_back(std::move(fit));
      own_fits_.clear();
    }
    if (std::none_of(fits_.begin(), fits_.end(),
                     [&](const TrackFit& fit) { return Agrees(fit); })) {
      frame_.spares.Resize(0, &fits_);
      return;
    }
    Merge(map_, MergedWeight::kSum, &frame_.spares, &fits_);
    TakeFits();
  }

  // The fits' states take the place of those before.
  void TakeFits() {
    Rank(options_, &frame_.spares, &fits_);
    spare_states_.Resize(fits_.size(), &states_);
    for (std::size_t i = 0; i < fits_.size(); ++i) states_[i] = fits_[i].state;
  }

  void Answer(TrackedPose* tracked) {
    PoseEstimate& estimate = tracked->estimate;
    estimate.notes = problems_;
    estimate.hypotheses.resize(states_.size());
    for (std::size_t i = 0; i < states_.size(); ++i) {
      PoseHypothesis& h = estimate.hypotheses[i];
      FillHypothesis(map_, states_[i], fitted_.camera, &h);
      if (!fits_.empty())
        FillFrame(frame_, fits_[i], &h, i == 0 ? &estimate.notes : nullptr, &distances_);
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
    Answer(tracked);
    tracked->estimate.status.message =
        is_blank_ ? "nothing of the map is seen in this frame: the pose is predicted"
                  : "the frame contradicts all hypotheses: the pose is predicted without it";
  }

  TrackerOptions options_;
  Status options_status_;
  TrackMap map_;
  std::vector<TrackState> states_;
  double time_ = -std::numeric_limits<double>::infinity(), used_ = time_;  // Seconds.
  int contradictions_ = 0, frames_ = 0;
  // Of the present frame; kept for their memory.
  Observations fitted_;
  FitMemory fit_memory_;
  PointNoiseMeter noise_meter_;
  PointNoise noise_;
  std::vector<std::string> problems_;
  TrackFrame frame_;
  std::vector<TrackFit> fits_, own_fits_;  // The latter of one hypothesis.
  bool is_blank_ = false;
  Spares<TrackState> spare_states_;
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
