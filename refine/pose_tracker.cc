#include "circline/refine/pose_tracker.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "circline/estimators/point_noise.h"
#include "circline/refine/chi_square.h"
#include "circline/refine/track_frame.h"
#include "circline/refine/track_map.h"
#include "circline/refine/track_result.h"
#include "circline/refine/track_state.h"

namespace circline {
namespace {

bool IsPositiveDefinite(const std::array<double, 36>& covariance) {
  const Eigen::Map<const Matrix6d> P(covariance.data());
  return P.allFinite() && Eigen::LLT<Matrix6d>(P).info() == Eigen::Success;
}

bool IsRotation(const Eigen::Matrix3d& R) {
  constexpr double kTolerance = 1e-6;
  return (R * R.transpose()).isIdentity(kTolerance) && R.determinant() > 0.0;
}

// Whether two fits of a frame are one minimum, or so near that it does not matter: the squared
// distance of their poses under both covariances.
bool IsSame(const TrackMap& map, const TrackFit& a, const TrackFit& b) {
  constexpr double kSame = 0.25;  // Half a standard deviation.
  const CameraPose p = a.state.Pose(map), q = b.state.Pose(map);
  const int size = map.tangent(TrackMap::kTurnRate);
  Eigen::VectorXd e(size);
  e.head<3>() = LogRotation(p.rotation.transpose() * q.rotation);
  if (size == 6) e.tail<3>() = q.translation - p.translation;
  const Eigen::LLT<Eigen::MatrixXd> llt(a.state.covariance.topLeftCorner(size, size) +
                                        b.state.covariance.topLeftCorner(size, size));
  return llt.info() == Eigen::Success && e.dot(llt.solve(e)) < kSame;
}

double LogAdd(double a, double b) {
  if (std::isinf(a)) return b;
  return std::max(a, b) + std::log1p(std::exp(-std::abs(a - b)));
}

// Minima that several starts lead to are one. What `both` makes of two log weights: the larger one
// of two starts of a hypothesis, the sum of the probabilities of two hypotheses.
void Merge(const TrackMap& map, double (*both)(double, double), std::vector<TrackFit>* fits) {
  std::vector<TrackFit> merged;
  for (TrackFit& fit : *fits) {
    const auto same = std::find_if(merged.begin(), merged.end(),
                                   [&](const TrackFit& other) { return IsSame(map, fit, other); });
    if (same == merged.end()) {
      merged.push_back(std::move(fit));
      continue;
    }
    const double a = same->state.log_weight, b = fit.state.log_weight;
    if (b > a) *same = std::move(fit);
    same->state.log_weight = both(a, b);
  }
  *fits = std::move(merged);
}

double LogWeight(const TrackState& state) { return state.log_weight; }
double LogWeight(const TrackFit& fit) { return fit.state.log_weight; }
double& LogWeight(TrackState& state) { return state.log_weight; }
double& LogWeight(TrackFit& fit) { return fit.state.log_weight; }

template <typename T>
void Normalize(std::vector<T>* all) {
  double sum = -std::numeric_limits<double>::infinity();
  for (const T& one : *all) sum = LogAdd(sum, LogWeight(one));
  for (T& one : *all) LogWeight(one) -= sum;
}

// Log weights to log probabilities; drops what is improbable and orders the rest. The first stays
// first unless another one is clearly more probable.
template <typename T>
void Rank(const TrackerOptions& options, std::vector<T>* all) {
  Normalize(all);
  const auto is_more = [](const T& a, const T& b) { return LogWeight(a) > LogWeight(b); };
  const auto best = std::min_element(all->begin(), all->end(), is_more);
  if (LogWeight(*best) > LogWeight(all->front()) + std::log(options.flip_odds))
    std::rotate(all->begin(), best, best + 1);
  std::stable_sort(all->begin() + 1, all->end(), is_more);
  const double least = std::log(options.min_probability);
  all->erase(std::remove_if(all->begin() + 1, all->end(),
                            [&](const T& one) { return LogWeight(one) < least; }),
             all->end());
  const auto most = static_cast<std::size_t>(options.max_hypotheses);
  if (all->size() > most) all->erase(all->begin() + options.max_hypotheses, all->end());
  Normalize(all);
}

std::string DecidedBy(const std::vector<PoseHypothesis>& hypotheses) {
  if (hypotheses.size() < 2) return "only one pose fits the evidence of all frames";
  constexpr double kSure = 0.95;
  if (hypotheses[0].probability < kSure)
    return "nothing decides: several poses explain the evidence of all frames";
  char text[120];
  std::snprintf(text, sizeof(text), "all frames so far: odds of %.3g to the second pose",
                hypotheses[0].probability / std::max(hypotheses[1].probability, 1e-300));
  return text;
}

}  // namespace

Status TrackerOptions::Validate() const {
  const Status status = estimation.Validate();
  if (!status.ok()) return status;
  const std::pair<double, const char*> positive[] = {
      {turn_rate_sigma, "turn_rate_sigma"},
      {velocity_sigma, "velocity_sigma"},
      {initial_turn_rate_sigma, "initial_turn_rate_sigma"},
      {initial_velocity_sigma, "initial_velocity_sigma"},
      {max_gap_s, "max_gap_s"}};
  for (const auto& [value, name] : positive) {
    if (!(value > 0.0) || !std::isfinite(value))
      return Status::Invalid(std::string(name) + " must be positive");
  }
  for (const auto& [value, name] : {std::pair(min_probability, "min_probability"),
                                    std::pair(gate_probability, "gate_probability")}) {
    if (!(value > 0.0 && value < 1.0))
      return Status::Invalid(std::string(name) + " must be between 0 and 1");
  }
  if (!(flip_odds >= 1.0)) return Status::Invalid("flip_odds must be 1 or more");
  if (max_hypotheses < 1) return Status::Invalid("max_hypotheses must be 1 or more");
  if (lost_after < 1) return Status::Invalid("lost_after must be 1 or more");
  if (max_evaluations < 2) return Status::Invalid("max_evaluations must be 2 or more");
  return Status::Ok();
}

Status MotionPrior::Validate() const {
  if (relative && (!IsRotation(relative->now_from_before.rotation) ||
                   !relative->now_from_before.translation.allFinite() ||
                   !IsPositiveDefinite(relative->covariance))) {
    return Status::Invalid(
        "relative must be a rotation, a finite translation and a positive definite covariance");
  }
  EstimationOptions options;
  if (absolute) options.pose_prior = *absolute;
  if (gravity) options.gravity_prior = *gravity;
  return options.Validate();
}

class PoseTracker::Implementation {
 public:
  explicit Implementation(const TrackerOptions& options)
      : options_(options), options_status_(options.Validate()) {}

  TrackedPose Update(const Observations& observations, double time, const MotionPrior& motion) {
    TrackedPose tracked;
    tracked.timestamp_s = time;
    tracked.estimate.solver = "tracker";
    Status status = options_status_;
    if (status.ok() && !std::isfinite(time)) status = Status::Invalid("the time must be finite");
    if (status.ok() && time < time_)
      status = Status::Invalid("the time must not be before that of the last call");
    if (status.ok()) status = motion.Validate();
    if (status.ok()) status = observations.Validate();
    tracked.estimate.status = status;
    if (!status.ok()) return tracked;

    const double dt = states_.empty() ? 0.0 : time - time_;
    if (!states_.empty() && motion.relative && !(dt > 0.0)) {
      tracked.estimate.status = Status::Invalid("a relative motion takes time: give a later one");
      return tracked;
    }
    time_ = time;
    Prepare(observations);
    if (states_.empty() || time - used_ > options_.max_gap_s) {
      Start(observations, &tracked);
      if (!tracked.estimate.status.ok()) states_.clear();
      return tracked;
    }
    Move(dt, motion);
    Refine();
    if (fits_.empty()) {
      Predicted(observations, &tracked);
      return tracked;
    }
    contradictions_ = 0;
    used_ = time;
    tracked.frames_since_start = ++frames_;
    Answer(&tracked);
    ExtendMap(fitted_, options_, &map_, &states_);
    return tracked;
  }

  std::optional<PoseHypothesis> Predict(double time) const {
    // Beyond the gap the next frame begins anew: nothing is expected.
    if (states_.empty() || !(time >= time_) || !(time - used_ <= options_.max_gap_s)) return {};
    TrackState state = states_.front();
    MoveOn(map_, options_, time - time_, &state);
    PoseHypothesis h = HypothesisOf(map_, state, fitted_.camera);
    h.probability = std::exp(state.log_weight);
    return h;
  }

  void Reset() {
    states_.clear();
    time_ = used_ = -std::numeric_limits<double>::infinity();
    contradictions_ = frames_ = 0;
  }

  const TrackerOptions& options() const { return options_; }

 private:
  void Prepare(const Observations& observations) {
    constexpr double kDefaultSigmaPx = 0.4;  // For fits that nobody has made yet.
    const double scale = options_.estimation.line_loss.scale_px;
    fitted_ = observations;
    problems_.clear();
    FitDirect(scale > 0.0 ? scale : kDefaultSigmaPx, &fitted_, &problems_);
    noise_ = MeasurePointNoise(fitted_, options_.estimation.noise_model);
  }

  // Begins a track with the poses of a single frame; the track before ends where there are any.
  void Start(const Observations& observations, TrackedPose* tracked) {
    PoseEstimate& estimate = tracked->estimate;
    estimate = EstimatePose(observations, options_.estimation);
    estimate.solver = "tracker";
    if (!estimate.status.ok()) return;
    if (!states_.empty()) estimate.notes.emplace_back("the track was lost and starts anew");
    tracked->reinitialized = true;
    contradictions_ = frames_ = 0;
    used_ = time_;
    const Observations resolved = ResolveWorld(fitted_);
    StartMap(resolved, estimate.hypotheses, options_, &map_, &states_);
    const TrackFrame frame(resolved, noise_, options_.estimation, map_);
    std::vector<TrackFit> fits;
    for (const TrackState& state : states_) {
      TrackFit fit;
      if (!frame.RefineHere(state, options_, &fit)) continue;
      ConditionOnPriors(&fit.state);
      fit.state.log_weight = state.log_weight;  // Its evidence has been counted.
      fits.push_back(std::move(fit));
    }
    // What cannot be refined here cannot be carried on; the frame's answer stands.
    if (!fits.empty()) Rank(options_, &fits);
    states_.clear();
    for (TrackFit& fit : fits) states_.push_back(std::move(fit.state));
    if (fitted_.frame.plane.empty()) map_.plane = NamedPlane(fitted_, map_.plane);
  }

  // What is known of the first pose counts in those that follow.
  void ConditionOnPriors(TrackState* state) const {
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
      Condition(map_, prior, state);
    }
    if (known.gravity_prior) Condition(map_, *known.gravity_prior, state);
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

  void Move(double dt, const MotionPrior& motion) {
    for (TrackState& state : states_) {
      if (motion.relative) {
        MoveBy(map_, options_, *motion.relative, dt, &state);
      } else {
        MoveOn(map_, options_, dt, &state);
      }
      if (motion.absolute) Condition(map_, *motion.absolute, &state);
      if (motion.gravity) Condition(map_, *motion.gravity, &state);
    }
    Rank(options_, &states_);  // For a frame that says nothing more.
  }

  // Fills fits_, ranked; empty where the frame says nothing or contradicts all hypotheses.
  void Refine() {
    fits_.clear();
    frame_ = std::make_unique<TrackFrame>(fitted_, noise_, options_.estimation, map_);
    is_blank_ = frame_->empty();
    if (is_blank_) return;
    for (std::size_t i = 0; i < states_.size(); ++i) {
      std::vector<TrackFit> own;
      frame_->Refine(states_[i], options_, &own);
      Merge(
          map_, [](double a, double b) { return std::max(a, b); }, &own);
      std::move(own.begin(), own.end(), std::back_inserter(fits_));
    }
    if (std::none_of(fits_.begin(), fits_.end(), [&](const TrackFit& fit) {
          return fit.misfit <= ChiSquareLimit(std::max(1, fit.dof), options_.gate_probability);
        })) {
      fits_.clear();
      return;
    }
    Merge(map_, LogAdd, &fits_);
    Rank(options_, &fits_);
    states_.clear();
    for (const TrackFit& fit : fits_) states_.push_back(fit.state);
  }

  void Answer(TrackedPose* tracked) const {
    PoseEstimate& estimate = tracked->estimate;
    estimate.notes = problems_;
    for (std::size_t i = 0; i < states_.size(); ++i) {
      PoseHypothesis h = HypothesisOf(map_, states_[i], fitted_.camera);
      h.probability = std::exp(states_[i].log_weight);
      if (!fits_.empty()) FillFrame(*frame_, fits_[i], &h, i == 0 ? &estimate.notes : nullptr);
      estimate.hypotheses.push_back(std::move(h));
    }
    estimate.decided_by = DecidedBy(estimate.hypotheses);
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
  PointNoise noise_;
  std::vector<std::string> problems_;
  std::unique_ptr<TrackFrame> frame_;
  std::vector<TrackFit> fits_;
  bool is_blank_ = false;
};

PoseTracker::PoseTracker(const TrackerOptions& options)
    : implementation_(std::make_unique<Implementation>(options)) {}
PoseTracker::~PoseTracker() = default;
PoseTracker::PoseTracker(PoseTracker&&) noexcept = default;
PoseTracker& PoseTracker::operator=(PoseTracker&&) noexcept = default;

TrackedPose PoseTracker::Update(const Observations& observations, double timestamp_s) {
  return implementation_->Update(observations, timestamp_s, MotionPrior());
}

TrackedPose PoseTracker::Update(const Observations& observations, double timestamp_s,
                                const MotionPrior& motion) {
  return implementation_->Update(observations, timestamp_s, motion);
}

std::optional<PoseHypothesis> PoseTracker::Predict(double timestamp_s) const {
  return implementation_->Predict(timestamp_s);
}

void PoseTracker::Reset() { implementation_->Reset(); }

}  // namespace circline
