#include <algorithm>
#include <cmath>
#include <string>

#include "circline/refine/track_steps.h"

namespace circline {

bool TellsFocal(const PoseHypothesis& h, const CameraSigma& sigma) {
  // Relative. Told to so much, Gaussians follow it: of 0.05 to 0.25, on simulated sequences of two
  // circles, where 0.1 does, and on mire-2, where it does not. And better than it was known.
  constexpr double kTold = 0.05, kOfPrior = 0.95;
  return h.focal_sigma < std::min(kTold, kOfPrior * sigma.LargestLogFocal()) * h.focal_scale;
}

bool LacksFocal(const TrackMap& map) { return map.camera_is_unknown && map.camera_is_considered; }

std::string WhatIsTold(const PoseHypothesis& own, const TrackMap& map, const TrackState& state) {
  // The world of the frames before is lost for it: much better, or sure.
  constexpr double kMuchBetter = 0.5, kSure = 0.9;
  const int focal = map.tangent(TrackMap::kCamera);
  if (LacksFocal(map) &&
      own.focal_sigma < kMuchBetter * own.focal_scale * std::sqrt(state.covariance(focal, focal)))
    return "this frame tells the focal length, which those before hardly did";
  if (!map.has_position() && !own.circles.empty() && own.probability >= kSure)
    return "this frame shows a circle of the world's plane, and those before did not";
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
