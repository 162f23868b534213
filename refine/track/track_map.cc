#include <ceres/sphere_manifold.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <utility>

#include "circline/estimators/directions.h"
#include "circline/refine/evidence_points.h"
#include "circline/refine/manifolds.h"
#include "circline/refine/plane_circle.h"
#include "circline/refine/track/track_steps.h"

namespace circline {
namespace {

// Bounds what a call costs; features beyond these stay without a part.
constexpr std::size_t kMaxCircles = 64, kMaxDirections = 32;

class MapBuilder {
 public:
  MapBuilder(const Observations& frame, const TrackerOptions& options, TrackMap* map,
             Kept<TrackFit>* states)
      : frame_(frame), noise_(options.estimation.noise_model), map_(*map), states_(*states) {}

  // `is_first`: it fixes the origin and the unit.
  void AddCircle(const CircleObservation& circle, bool is_first) {
    if (map_.circles.size() >= kMaxCircles) return;
    std::vector<Eigen::Vector3d> placed;
    std::vector<CalibratedPoint> points;
    for (const TrackFit& fit : states_) {
      const CameraPose pose = fit.state.Pose(map_);
      CalibrateInliers(CameraOf(fit.state), circle.points, circle.inliers, &points);
      Eigen::Vector3d at;
      // Beyond a hypothesis' horizon: anywhere, and the frames to come decide.
      if (!FitPlaneCircle(points, pose, &at))
        at = Eigen::Vector3d(0.0, 0.0, pose.translation.norm());
      placed.push_back(at);
    }
    TrackMap::Circle added;
    added.id = circle.id;
    added.center = SharedBlock(circle, &TrackMap::Circle::center);
    added.radius = SharedBlock(circle, &TrackMap::Circle::radius);
    if (added.center < 0) {
      added.center = map_.AddBlock(2, {}, is_first);
      for (std::size_t i = 0; i < placed.size(); ++i)
        states_[i].state.Append(map_, added.center, Eigen::VectorXd(placed[i].head<2>()),
                                Length(i, 2));
    }
    if (added.radius < 0) {
      added.radius = map_.AddBlock(1, {}, is_first);
      const double stated = circle.radius_sigma > 0.0 ? circle.radius_sigma : noise_.radius;
      constexpr double kExact = 1e-6;  // Stands for a radius that is known exactly.
      const bool known = map_.metric && circle.radius > 0.0;
      for (std::size_t i = 0; i < placed.size(); ++i) {
        const double radius = known ? circle.radius : placed[i].z();
        states_[i].state.Append(map_, added.radius, One(radius),
                                known ? One(radius * std::max(stated, kExact)) : Length(i, 1));
      }
    }
    AddImperfections(circle, &added);
    map_.circles.push_back(std::move(added));
  }

  // `role`: of its pencil in this frame's world.
  void AddDirection(const std::string& id, PencilDirection role, bool in_plane,
                    const Eigen::Vector3d& in_camera) {
    if (map_.directions.size() >= kMaxDirections) return;
    const double lean = noise_.pencil_axis_rad;
    const bool is_free = role == PencilDirection::kFree, is_exact = !(lean > 0.0);
    std::unique_ptr<ceres::Manifold> manifold;
    if (is_free && in_plane && is_exact) {
      manifold = std::make_unique<InPlaneManifold>();
    } else if (is_free || !is_exact) {
      manifold = std::make_unique<ceres::SphereManifold<3>>();
    }
    const bool is_constant = manifold == nullptr;
    const int block = map_.AddBlock(3, std::move(manifold), is_constant);
    for (TrackFit& fit : states_) {
      TrackState& state = fit.state;
      Eigen::Vector3d d = state.Pose(map_).rotation.transpose() *
                          ChangeOfCamera(frame_.camera, CameraOf(state)) * in_camera;
      if (!is_free) d = Eigen::Vector3d::Unit(static_cast<int>(role));
      if (is_free && in_plane) d.z() = 0.0;
      constexpr double kNone = 1e-6;
      d = d.norm() > kNone ? d.normalized() : Eigen::Vector3d::UnitX();
      Eigen::Vector3d sigma = Eigen::Vector3d::Constant(is_free ? kUnknown : lean);
      if (in_plane) sigma.z() = lean;
      const Eigen::MatrixXd plus = map_.block(block).PlusJacobian(d.data());
      Eigen::MatrixXd covariance = plus.transpose() * sigma.cwiseAbs2().asDiagonal() * plus;
      if (is_constant) covariance.resize(0, 0);
      state.Append(map_, block, d.data(), covariance);
    }
    map_.directions.push_back({id, block, role});
  }

 private:
  // That a hypothesis sees this frame through.
  Camera CameraOf(const TrackState& state) const {
    return ShiftedCamera(frame_.camera, state.x.data() + map_.block(TrackMap::kCamera).offset);
  }

  // Standard deviation of an unknown length.
  Eigen::VectorXd Length(std::size_t i, int size) const {
    return Eigen::VectorXd::Constant(size,
                                     kUnknown * states_[i].state.Pose(map_).translation.norm());
  }

  static Eigen::VectorXd One(double value) { return Eigen::VectorXd::Constant(1, value); }

  // The same to all hypotheses, about zeros.
  void Append(int block, const Eigen::VectorXd& sigmas) {
    for (TrackFit& fit : states_)
      fit.state.Append(map_, block, Eigen::VectorXd::Zero(sigmas.size()), sigmas);
  }

  // Of a circle of the map with the same centre, or the same radius; -1 where there is none.
  int SharedBlock(const CircleObservation& circle, int TrackMap::Circle::*block) const {
    const bool is_center = block == &TrackMap::Circle::center;
    const auto group = [is_center](const CircleObservation& c) {
      return is_center ? c.concentric : c.radius_group;
    };
    if (group(circle).empty()) return -1;
    for (const TrackMap::Circle& other : map_.circles) {
      const int index = FindCircle(frame_, other.id);
      if (index >= 0 && group(frame_.circles[static_cast<std::size_t>(index)]) == group(circle))
        return other.*block;
    }
    return -1;
  }

  // What does not average out over frames: the circle's own tilt and height, and the offset of all
  // contours of its contrast.
  void AddImperfections(const CircleObservation& circle, TrackMap::Circle* added) {
    const std::array<double, 3> tilt = TiltSigmas(noise_);
    if (tilt[0] > 0.0) {
      added->tilt = map_.AddBlock(3);
      Append(added->tilt, Eigen::Vector3d(tilt.data()));
    }
    if (!(noise_.contour_offset_px > 0.0)) return;
    added->contrast = std::clamp(circle.contrast, -1, 1);
    for (const TrackMap::Circle& other : map_.circles) {
      if (other.contrast == added->contrast) added->offset = other.offset;
    }
    if (added->offset >= 0) return;
    added->offset = map_.AddBlock(1);
    Append(added->offset, One(noise_.contour_offset_px));
  }

  const Observations& frame_;
  const NoiseModel& noise_;
  TrackMap& map_;
  Kept<TrackFit>& states_;
};

// Pose, velocities and camera of a hypothesis, as a first frame's evidence finds them.
// `k1`: the prior's mean, against the camera that the frame comes with.
TrackState FirstState(const TrackMap& map, const PoseHypothesis& h, const TrackerOptions& options,
                      const Shifts& camera_sigmas, double k1) {
  TrackState state;
  const Eigen::VectorXd zeros = Eigen::VectorXd::Zero(kCameraSize);
  for (const int block :
       {TrackMap::kRotation, TrackMap::kTranslation, TrackMap::kTurnRate, TrackMap::kVelocity})
    state.Append(map, block, zeros, zeros);
  // A turn that nothing fixes is what the first frame's convention says.
  constexpr double kConvention = 1e-4;  // Radians.
  SetUnknownMotion(map, options, h.cam_from_world, h.RotationIsFree() ? kConvention : kUnknown,
                   &state);
  const Block& block = map.block(TrackMap::kCamera);
  Eigen::MatrixXd covariance(0, 0);
  if (block.tangent_size() > 0) {
    const Eigen::MatrixXd chart =
        block.Chart(zeros.data()) *
        Eigen::Map<const Eigen::VectorXd>(camera_sigmas.data(), kCameraSize).asDiagonal();
    covariance = chart * chart.transpose();
  }
  Eigen::VectorXd mean = zeros;
  if (block.tangent_size() > 0) {
    mean[0] = std::log(h.focal_scale);
    mean[4] = k1;
  }
  state.Append(map, TrackMap::kCamera, mean.data(), covariance);
  state.log_weight = std::log(std::max(h.probability, 1e-300));
  return state;
}

bool InPlane(const std::string& plane, const TrackMap& map) {
  return !plane.empty() && plane == map.plane;
}

// Whether the axes of a later frame are the tracker's: where a pencil that the map knows has the
// same role in it. A detector names the axes of each frame's world anew, and a turn that nothing
// fixed in the first frame has a convention since.
bool SharesAxes(const Observations& frame, const TrackMap& map) {
  return std::any_of(
      map.directions.begin(), map.directions.end(), [&](const TrackMap::Direction& d) {
        const int index = d.role == PencilDirection::kFree ? -1 : FindPencil(frame, d.id);
        return index >= 0 && frame.pencils[static_cast<std::size_t>(index)].direction == d.role;
      });
}

void AddDirections(const Observations& frame, const TrackMap& map, bool shares_axes,
                   MapBuilder* builder) {
  const auto is_known = [&](const std::string& id) {
    return std::any_of(map.directions.begin(), map.directions.end(),
                       [&](const TrackMap::Direction& d) { return d.id == id; });
  };
  if (shares_axes && frame.frame.x_axis && !is_known(kXAxisId))
    builder->AddDirection(kXAxisId, PencilDirection::kX, true, Eigen::Vector3d::UnitX());
  if (shares_axes && frame.frame.y_axis && !is_known(kYAxisId))
    builder->AddDirection(kYAxisId, PencilDirection::kY, true, Eigen::Vector3d::UnitY());
  for (const PencilObservation& pencil : frame.pencils) {
    const PencilDirection role = shares_axes ? pencil.direction : PencilDirection::kFree;
    if (is_known(pencil.id) || (role == PencilDirection::kFree && !pencil.fit)) continue;
    builder->AddDirection(pencil.id, role, InPlane(pencil.plane, map),
                          pencil.fit ? pencil.fit->direction : Eigen::Vector3d::UnitX());
  }
}

}  // namespace

void SetUnknownMotion(const TrackMap& map, const TrackerOptions& options, const CameraPose& pose,
                      double normal_turn_sigma, TrackState* state) {
  const double distance = pose.translation.norm();
  const auto set = [&](int block, const Eigen::Vector3d& sigma) {
    const int row = map.tangent(block), size = map.block(block).tangent_size();
    state->covariance.middleRows(row, size).setZero();
    state->covariance.middleCols(row, size).setZero();
    state->covariance.diagonal().segment(row, size) = sigma.head(size).cwiseAbs2();
  };
  const auto all = [](double sigma) -> Eigen::Vector3d { return Eigen::Vector3d::Constant(sigma); };
  set(TrackMap::kRotation, {kUnknown, kUnknown, normal_turn_sigma});
  set(TrackMap::kTranslation, all(kUnknown * distance));
  set(TrackMap::kTurnRate, all(options.initial_turn_rate_sigma));
  set(TrackMap::kVelocity, all(options.initial_velocity_sigma * distance));
  state->SetPose(map, pose);
  for (const int block : {TrackMap::kTurnRate, TrackMap::kVelocity})
    state->x.segment<3>(map.block(block).offset).setZero();
}

void StartMap(const Observations& resolved, const std::vector<PoseHypothesis>& hypotheses,
              const TrackerOptions& options, TrackMap* map, Kept<TrackFit>* states) {
  const EstimationOptions& estimation = options.estimation;
  const CameraSigma sigma =
      estimation.camera_sigma.value_or(estimation.noise_model.SigmaOf(resolved.camera));
  const auto takes_part = [&](const CircleObservation& c) {
    return c.fit && c.plane == resolved.frame.plane;
  };
  const auto first = std::find_if(resolved.circles.begin(), resolved.circles.end(), takes_part);
  const bool has_position = first != resolved.circles.end();
  map->Reset(has_position, resolved.camera, sigma, TellsFocal(hypotheses.front(), sigma));
  map->metric = hypotheses.front().metric;
  map->origin_observed = hypotheses.front().origin_observed;
  map->plane = resolved.frame.plane;
  states->Shorten(0);
  const double k1 = sigma.k1 > 0.0 ? -resolved.found_k1 : 0.0;
  Shifts sigmas = ShiftSigmas(resolved.camera, sigma);
  for (const PoseHypothesis& h : hypotheses) {
    // What is only considered is known as well as this frame tells it.
    if (map->camera_is_unknown && map->camera_is_considered)
      sigmas[0] = h.focal_sigma / h.focal_scale;
    states->Add().state = FirstState(*map, h, options, sigmas, k1);
  }
  MapBuilder builder(resolved, options, map, states);
  if (has_position) {
    const auto is_at_origin = [&](const CircleObservation& c) {
      return takes_part(c) && c.id == resolved.frame.origin_is_center;
    };
    const auto named = std::find_if(resolved.circles.begin(), resolved.circles.end(), is_at_origin);
    const auto& base = named != resolved.circles.end() ? named : first;
    builder.AddCircle(*base, true);
    for (auto c = resolved.circles.begin(); c != resolved.circles.end(); ++c) {
      if (c != base && takes_part(*c)) builder.AddCircle(*c, false);
    }
  }
  AddDirections(resolved, *map, true, &builder);
  // Landmarks lie where they are seen through a hypothesis' camera; a prior is about the one given.
  if (map->camera_is_considered) return;
  for (TrackFit& fit : *states)
    fit.state.x[map->block(TrackMap::kCamera).offset] = StatedLogFocal(resolved);
}

void ExtendMap(const Observations& fitted, const TrackerOptions& options, TrackMap* map,
               Kept<TrackFit>* states) {
  MapBuilder builder(fitted, options, map, states);
  for (const CircleObservation& circle : fitted.circles) {
    const bool is_known = std::any_of(map->circles.begin(), map->circles.end(),
                                      [&](const TrackMap::Circle& c) { return c.id == circle.id; });
    if (!is_known && map->has_position() && circle.fit && InPlane(circle.plane, *map))
      builder.AddCircle(circle, false);
  }
  AddDirections(fitted, *map, SharesAxes(fitted, *map), &builder);
}

}  // namespace circline
