// What a tracker and a call of it may be asked for.
#include <cmath>
#include <string>
#include <utility>

#include "circline/refine/joint/known_pose.h"
#include "circline/refine/pose_tracker.h"

namespace circline {
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

}  // namespace circline
