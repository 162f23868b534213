#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/refine/many/adjust_layout.h"
#include "circline/refine/track/track_steps.h"

namespace circline {
namespace {

Layout LayoutOf(const TrackMap& map, const TrackState& state) {
  Layout layout;
  for (const TrackMap::Circle& circle : map.circles) {
    const double* center = state.x.data() + map.block(circle.center).offset;
    layout[circle.id] = {{center[0], center[1]},
                         std::abs(state.x[map.block(circle.radius).offset])};
  }
  return layout;
}

// By how much the frame's axes may be turned against the map's about the normal, as a direction of
// the plane has it, which has no sense. Empty: none is seen.
std::vector<double> TurnsOfDirections(const TrackMap& map, const TrackState& state,
                                      const PoseHypothesis& h) {
  for (const TrackMap::Direction& direction : map.directions) {
    const auto other = std::find_if(h.pencils.begin(), h.pencils.end(),
                                    [&](const PencilEstimate& p) { return p.id == direction.id; });
    if (other == h.pencils.end()) continue;
    const Eigen::Vector3d own = h.cam_from_world.rotation.transpose() * other->direction,
                          known = state.Vector(map, direction.block);
    constexpr double kAcross = 0.5;  // Of a unit vector, in the plane.
    if (own.head<2>().norm() < kAcross || known.head<2>().norm() < kAcross) continue;
    const double turn = std::atan2(known.y(), known.x()) - std::atan2(own.y(), own.x());
    return {turn, turn + kPi};
  }
  return {};
}

// That takes a circle to another, turned so far.
Similarity TurnedTo(const LayoutCircle& from, const LayoutCircle& to, double turn) {
  Similarity out;
  out.scale = to.radius / from.radius;
  out.turn = out.scale * Eigen::Rotation2Dd(turn).toRotationMatrix();
  out.shift = to.center - out.turn * from.center;
  return out;
}

}  // namespace

std::vector<TrackState> Relocated(const TrackMap& map, const Kept<TrackFit>& states,
                                  const std::vector<PoseHypothesis>& seen,
                                  const TrackerOptions& options) {
  std::vector<TrackState> out;
  if (states.empty() || !map.has_position()) return out;
  for (const TrackFit& fit : states) {
    const Layout known = LayoutOf(map, fit.state);
    const Places to = PlacesOf(known);
    for (const PoseHypothesis& h : seen) {
      const auto add = [&](const Similarity& to_map, double normal_turn_sigma) {
        SetUnknownMotion(map, options, MovedPose(h.cam_from_world, to_map), normal_turn_sigma,
                         &out.emplace_back(fit.state));
      };
      const Layout own = LayoutOf(h);
      const Places from = PlacesOf(own);
      Alignment alignment;
      const bool is_aligned = AlignById(from, to, &alignment);
      if (alignment.pairs.empty()) continue;
      const LayoutCircle &a = from[alignment.pairs[0][0]].circle,
                         &b = to[alignment.pairs[0][1]].circle;
      // Of the distance to the camera: circles about one centre.
      constexpr double kOneCenter = 0.01;
      const double distance = h.cam_from_world.translation.norm();
      const bool are_apart = std::any_of(alignment.pairs.begin(), alignment.pairs.end(),
                                         [&](const std::array<std::size_t, 2>& pair) {
                                           return (from[pair[0]].circle.center - a.center).norm() >
                                                  kOneCenter * distance;
                                         });
      if (is_aligned && are_apart) {
        add(alignment.to_shared, kUnknown);
        continue;
      }
      constexpr double kUniformTurn = 1.8;  // Standard deviation of a turn by any angle.
      std::vector<double> turns = TurnsOfDirections(map, fit.state, h);
      const bool is_free = turns.empty();
      if (is_free) turns.push_back(0.0);
      for (const double turn : turns) add(TurnedTo(a, b, turn), is_free ? kUniformTurn : kUnknown);
    }
  }
  return out;
}

}  // namespace circline
