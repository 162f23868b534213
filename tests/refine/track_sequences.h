// What tests of the tracker share.
#ifndef CIRCLINE_TESTS_REFINE_TRACK_SEQUENCES_H_
#define CIRCLINE_TESTS_REFINE_TRACK_SEQUENCES_H_

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "apps/benchmark/trajectory.h"
#include "circline/refine/pose_tracker.h"

namespace circline {

inline TrackerOptions ExactOptions(const TrajectoryOptions& trajectory) {
  TrackerOptions options;
  options.estimation.noise_model = NoiseModel::Exact();
  options.estimation.conic_loss.type = options.estimation.line_loss.type = LossType::kTrivial;
  options.turn_rate_sigma = trajectory.turn_rate_sigma;
  options.velocity_sigma = trajectory.velocity_sigma;
  options.initial_turn_rate_sigma = trajectory.initial_turn_rate_sigma;
  options.initial_velocity_sigma = trajectory.initial_velocity_sigma;
  return options;
}

inline double NormalError(const CameraPose& truth, const PoseHypothesis& h) {
  return std::acos(
      std::clamp(truth.rotation.col(2).dot(h.cam_from_world.rotation.col(2)), -1.0, 1.0));
}

inline double RotationError(const CameraPose& truth, const PoseHypothesis& h) {
  return LogRotation(truth.rotation * h.cam_from_world.rotation.transpose()).norm();
}

// The turn between two frames, as a gyroscope without error has it.
inline MotionPrior Gyroscope(const CameraPose& before, const CameraPose& now) {
  constexpr double kSigma = 0.001;
  MotionPrior motion;
  motion.relative.emplace();
  motion.relative->now_from_before.rotation = now.rotation * before.rotation.transpose();
  motion.relative->has_translation = false;
  for (std::size_t k = 0; k < 6; ++k) motion.relative->covariance[7 * k] = kSigma * kSigma;
  return motion;
}

}  // namespace circline

#endif  // CIRCLINE_TESTS_REFINE_TRACK_SEQUENCES_H_
