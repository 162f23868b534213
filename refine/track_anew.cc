#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "circline/estimators/basics.h"
#include "circline/refine/track_steps.h"

namespace circline {
namespace {

// Of the normal of the world's plane, radians: what is known of the world is hardly worth keeping.
constexpr double kVague = 5.0 * kDegree;

double LargestSigma(const Eigen::Matrix2d& covariance) {
  return std::sqrt(
      std::max(0.0, covariance.selfadjointView<Eigen::Lower>().eigenvalues().maxCoeff()));
}

// Standard deviation of the normal of the world's plane, radians.
double TiltSigma(const TrackState& state) {  // Turns are about the world's axes.
  return LargestSigma(state.covariance.topLeftCorner<2, 2>());
}

double TiltSigma(const PoseHypothesis& h) {
  constexpr double kTiny = 1e-6;
  const Eigen::Matrix3d world_from_cam = h.cam_from_world.rotation.transpose();
  for (const std::array<double, 6>& direction : h.free_directions) {
    const Eigen::Vector3d turn(direction[0], direction[1], direction[2]);
    if ((world_from_cam * turn).head<2>().norm() > kTiny)
      return std::numeric_limits<double>::infinity();
  }
  const Eigen::Matrix3d turns =
      world_from_cam * h.Covariance().topLeftCorner<3, 3>() * world_from_cam.transpose();
  return LargestSigma(turns.topLeftCorner<2, 2>());
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
  return LacksFocal(map) || !map.has_position() || TiltSigma(state) > kVague;
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
  if (TiltSigma(state) > kVague && TiltSigma(own) < kMuchBetter * TiltSigma(state))
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
