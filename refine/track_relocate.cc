#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "circline/estimators/basics.h"
#include "circline/refine/track_steps.h"

namespace circline {
namespace {

// A circle of the map as a frame's own pose sees it.
struct Seen {
  Eigen::Vector2d in_map, in_frame;  // Centres in the plane, each in its world's frame and unit.
  Eigen::Vector3d in_camera;         // Centre, in the frame's unit.
  double ratio = 1.0;                // Of the map's unit to the frame's.
};

Eigen::Vector2d InPlane(const PoseHypothesis& h, const Eigen::Vector3d& in_camera) {
  const Eigen::Vector3d X =
      h.cam_from_world.rotation.transpose() * (in_camera - h.cam_from_world.translation);
  return X.head<2>();
}

std::vector<Seen> CirclesOf(const TrackMap& map, const TrackState& state, const PoseHypothesis& h) {
  std::vector<Seen> seen;
  for (const TrackMap::Circle& circle : map.circles) {
    const auto other = std::find_if(h.circles.begin(), h.circles.end(),
                                    [&](const CircleEstimate& c) { return c.id == circle.id; });
    if (other == h.circles.end() || !(other->radius > 0.0)) continue;
    const double* center = state.x.data() + map.block(circle.center).offset;
    const double radius = std::abs(state.x[map.block(circle.radius).offset]);
    seen.push_back(
        {{center[0], center[1]}, InPlane(h, other->center), other->center, radius / other->radius});
  }
  return seen;
}

double AngleOf(const Eigen::Vector2d& v) { return std::atan2(v.y(), v.x()); }

// By how much the map's axes may be turned against the frame's about the normal: as the two circles
// farthest apart say, else as a direction of the plane does, which has no sense. Empty: nothing
// says.
std::vector<double> Spins(const TrackMap& map, const TrackState& state, const PoseHypothesis& h,
                          const std::vector<Seen>& seen) {
  const Seen& first = seen.front();
  const Seen& far = *std::max_element(seen.begin(), seen.end(), [&](const Seen& a, const Seen& b) {
    return (a.in_map - first.in_map).norm() < (b.in_map - first.in_map).norm();
  });
  constexpr double kOneCenter = 0.01;  // Of the distance to the camera: no direction.
  const double distance = first.in_camera.norm() * first.ratio;
  if ((far.in_map - first.in_map).norm() > kOneCenter * distance)
    return {AngleOf(far.in_frame - first.in_frame) - AngleOf(far.in_map - first.in_map)};
  for (const TrackMap::Direction& direction : map.directions) {
    const auto other = std::find_if(h.pencils.begin(), h.pencils.end(),
                                    [&](const PencilEstimate& p) { return p.id == direction.id; });
    if (other == h.pencils.end()) continue;
    const Eigen::Vector3d in_frame = h.cam_from_world.rotation.transpose() * other->direction,
                          in_map = state.Vector(map, direction.block);
    constexpr double kAcross = 0.5;  // Of a unit vector, in the plane.
    if (in_frame.head<2>().norm() < kAcross || in_map.head<2>().norm() < kAcross) continue;
    const double spin = AngleOf(in_frame.head<2>()) - AngleOf(in_map.head<2>());
    return {spin, spin + kPi};
  }
  return {};
}

// Pose and velocities as in a first frame, which knows nothing of them.
void Forget(const TrackMap& map, const TrackerOptions& options, const CameraPose& pose,
            bool spin_is_free, TrackState* state) {
  constexpr double kUnknown = 1.0;      // Radians; distances of the origin.
  constexpr double kUniformTurn = 1.8;  // Standard deviation of a turn by any angle.
  state->SetPose(map, pose);
  const double distance = pose.translation.norm();
  const Eigen::Index rows = map.tangent(TrackMap::kCamera);
  Eigen::MatrixXd& P = state->covariance;
  P.topRows(rows).setZero();
  P.leftCols(rows).setZero();
  const auto set = [&](int block, double sigma) {
    P.diagonal().segment<3>(map.tangent(block)).setConstant(sigma * sigma);
    if (block == TrackMap::kTurnRate || block == TrackMap::kVelocity)
      state->x.segment<3>(map.block(block).offset).setZero();
  };
  set(TrackMap::kRotation, kUnknown);
  if (spin_is_free) P(2, 2) = kUniformTurn * kUniformTurn;
  set(TrackMap::kTranslation, kUnknown * distance);
  set(TrackMap::kTurnRate, options.initial_turn_rate_sigma);
  set(TrackMap::kVelocity, options.initial_velocity_sigma * distance);
}

}  // namespace

std::vector<TrackState> Relocated(const TrackMap& map, const Kept<TrackFit>& states,
                                  const std::vector<PoseHypothesis>& seen,
                                  const TrackerOptions& options) {
  std::vector<TrackState> out;
  if (states.empty() || !map.has_position()) return out;
  for (const TrackFit& fit : states) {
    const TrackState& state = fit.state;
    for (const PoseHypothesis& h : seen) {
      const std::vector<Seen> circles = CirclesOf(map, state, h);
      if (circles.empty()) continue;
      std::vector<double> spins = Spins(map, state, h, circles);
      const bool is_free = spins.empty();
      if (is_free) spins.push_back(0.0);
      for (const double spin : spins) {
        const Seen& first = circles.front();
        CameraPose pose;
        pose.rotation = h.cam_from_world.rotation *
                        Eigen::AngleAxisd(spin, Eigen::Vector3d::UnitZ()).toRotationMatrix();
        pose.translation = first.ratio * first.in_camera -
                           pose.rotation * Eigen::Vector3d(first.in_map.x(), first.in_map.y(), 0.0);
        Forget(map, options, pose, is_free, &out.emplace_back(state));
      }
    }
  }
  return out;
}

}  // namespace circline
