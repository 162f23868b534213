#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <string>

#include "circline/estimators/basics.h"
#include "circline/estimators/directions.h"
#include "circline/refine/track/track_steps.h"

namespace circline {
namespace {

// Of the normal of the world's plane, radians: what is known of the world is hardly worth keeping.
constexpr double kVague = 5.0 * kDegree;

// Standard deviation of that normal. Turns are about the world's axes: that about the third one
// does not move it.
double SigmaNormal(const TrackState& state) {
  Eigen::Matrix3d turns = state.covariance.topLeftCorner<3, 3>();
  turns.row(2).setZero();
  turns.col(2).setZero();
  return LargestSigma(turns);
}

bool LacksFocal(const TrackMap& map) { return map.camera_is_unknown && map.camera_is_considered; }

}  // namespace

bool TellsFocal(const PoseHypothesis& h, const CameraSigma& sigma) {
  // Relative. Told to so much, Gaussians follow it: of 0.05 to 0.25, on simulated sequences of two
  // circles, where 0.1 does, and on mire-2, where it does not. And better than it was known.
  constexpr double kTold = 0.05, kOfPrior = 0.95;
  return h.focal_sigma < std::min(kTold, kOfPrior * sigma.LargestLogFocal()) * h.focal_scale;
}

bool LacksSomething(const TrackMap& map, const TrackState& state) {
  return LacksFocal(map) || !map.has_position() || SigmaNormal(state) > kVague;
}

std::string WhatIsTold(const PoseHypothesis& own, const TrackMap& map, const TrackState& state) {
  // The world of the frames before is lost for it: much better, or sure.
  constexpr double kMuchBetter = 0.5, kSure = 0.9;
  const int focal = map.tangent(TrackMap::kCamera);
  if (LacksFocal(map) &&
      own.focal_sigma < kMuchBetter * own.focal_scale * std::sqrt(state.covariance(focal, focal)))
    return "this frame tells the focal length, which those before hardly did";
  if (own.probability < kSure) return {};
  if (!map.has_position() && !own.circles.empty())
    return "this frame shows a circle of the world's plane, and those before did not";
  if (SigmaNormal(state) > kVague && own.SigmaNormal() < kMuchBetter * SigmaNormal(state))
    return "this frame tells the pose, which had become vague";
  return {};
}

int NumStrange(const Observations& frame, const TrackMap& map) {
  const auto count = [](const auto& features, const auto& known) {
    return std::count_if(features.begin(), features.end(), [&](const auto& feature) {
      return std::none_of(known.begin(), known.end(),
                          [&](const auto& other) { return other.id == feature.id; });
    });
  };
  return static_cast<int>(count(frame.circles, map.circles) + count(frame.pencils, map.directions));
}

}  // namespace circline
