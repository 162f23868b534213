#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <optional>
#include <utility>

#include "circline/estimators/basics.h"
#include "circline/estimators/directions.h"
#include "circline/refine/camera_shifts.h"
#include "circline/refine/joint/joint_result.h"
#include "circline/refine/track/track_steps.h"

namespace circline {
namespace {

// A turn this uncertain, radians, is one of which nothing is known: a uniform one has 1.8.
constexpr double kFreeTurn = 1.0;

void FillCovariance(const TrackMap& map, const TrackState& state, PoseHypothesis* h) {
  const Eigen::Matrix3d R = h->cam_from_world.rotation;
  const int size = map.has_position() ? 6 : 3;
  Matrix6d covariance = Matrix6d::Zero();
  covariance.topLeftCorner(size, size) = state.covariance.topLeftCorner(size, size);
  Matrix6d T = Matrix6d::Identity();
  T.topLeftCorner<3, 3>() = R;
  covariance = T * covariance * T.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(covariance.topLeftCorner<3, 3>());
  int num_known = 0;  // The least uncertain turns come first.
  while (num_known < 3 && !(eigen.eigenvalues()[num_known] > kFreeTurn * kFreeTurn)) ++num_known;
  for (int k = num_known; k < 3; ++k) {
    std::array<double, 6> direction{};
    Eigen::Map<Vector6d>(direction.data()).head<3>() = eigen.eigenvectors().col(k);
    h->free_directions.push_back(direction);
  }
  if (num_known < 3) {
    const auto known = eigen.eigenvectors().leftCols(num_known);
    Matrix6d onto = Matrix6d::Identity();
    onto.topLeftCorner<3, 3>() = known * known.transpose();
    covariance = onto * covariance * onto;
  }
  if (!map.has_position()) {
    for (int k = 3; k < 6; ++k) {
      std::array<double, 6> direction{};
      direction[static_cast<std::size_t>(k)] = 1.0;
      h->free_directions.push_back(direction);
    }
  }
  SetCovariance(covariance, h);
}

void FillLandmarks(const TrackMap& map, const TrackState& state, const Camera& camera,
                   PoseHypothesis* h) {
  const CameraPose& pose = h->cam_from_world;
  const auto at = [&](int block) { return state.x.data() + map.block(block).offset; };
  const double* shifts = at(TrackMap::kCamera);
  std::optional<Camera> shifted;
  if (std::any_of(shifts, shifts + kCameraSize, [](double shift) { return shift != 0.0; }))
    shifted = ShiftedCamera(camera, shifts);
  h->circles.resize(map.circles.size());
  auto circle = h->circles.begin();
  for (const TrackMap::Circle& c : map.circles) {
    CircleEstimate& estimate = *circle++;
    estimate.id = c.id;
    PlaceEstimate({at(c.center), at(c.radius)[0], c.tilt >= 0 ? at(c.tilt) : nullptr}, pose, 1.0,
                  shifted ? *shifted : camera, &estimate);
  }
  h->pencils.resize(map.directions.size());
  auto pencil = h->pencils.begin();
  for (const TrackMap::Direction& d : map.directions) {
    PencilEstimate& estimate = *pencil++;
    estimate.id = d.id;
    const Block& block = map.block(d.block);
    const Eigen::Vector3d in_world = Eigen::Map<const Eigen::Vector3d>(at(d.block)).normalized();
    estimate.direction = pose.rotation * in_world;
    const Eigen::Index rows = block.tangent_size();
    Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, 6> J(3, 3 + rows);
    J.leftCols<3>() = -CrossMatrix(in_world);
    if (rows > 0) J.rightCols(rows) = block.PlusJacobian(at(d.block));
    const Eigen::Index first = map.tangent(d.block);
    BlockMatrix joint(3 + rows, 3 + rows);  // Of the turn and the direction.
    joint.topLeftCorner<3, 3>() = state.covariance.topLeftCorner<3, 3>();
    joint.topRightCorner(3, rows) = state.covariance.block(0, first, 3, rows);
    joint.bottomLeftCorner(rows, 3) = state.covariance.block(first, 0, rows, 3);
    joint.bottomRightCorner(rows, rows) = state.covariance.block(first, first, rows, rows);
    estimate.sigma_deg = LargestSigmaDeg(J * joint * J.transpose());
  }
}

// The camera, where it is an unknown.
void FillCamera(const TrackMap& map, const TrackState& state, const Camera& camera,
                PoseHypothesis* h) {
  if (!map.camera_is_unknown || !map.has_camera()) return;
  const double* shifts = state.x.data() + map.block(TrackMap::kCamera).offset;
  const int column = map.tangent(TrackMap::kCamera);  // The focal length comes first.
  h->camera = ShiftedCamera(camera, shifts);
  h->focal_scale = std::exp(shifts[0]);
  h->focal_sigma = h->focal_scale * std::sqrt(std::max(0.0, state.covariance(column, column)));
  const Eigen::Index rows = map.has_position() ? 6 : 3;
  Vector6d across = Vector6d::Zero();
  across.head(rows) = state.covariance.col(column).head(rows);
  across.head<3>() = (h->cam_from_world.rotation * across.head<3>()).eval();
  Eigen::Map<Vector6d>(h->focal_covariance.data()) = h->focal_scale * across;
}

}  // namespace

void DecidedByFrames(const std::vector<PoseHypothesis>& hypotheses, std::string* decided_by) {
  constexpr double kSure = 0.95;
  if (hypotheses.size() < 2) {
    *decided_by = "only one pose fits the evidence of all frames";
  } else if (hypotheses[0].probability < kSure) {
    *decided_by = "nothing decides: several poses explain the evidence of all frames";
  } else {
    char text[120];
    std::snprintf(text, sizeof(text), "all frames so far: odds of %.3g to the second pose",
                  hypotheses[0].probability / std::max(hypotheses[1].probability, 1e-300));
    *decided_by = text;
  }
}

void FillHypothesis(const TrackMap& map, const TrackState& state, const Camera& camera,
                    PoseHypothesis* h) {
  // All but what keeps memory for what comes.
  PoseHypothesis fresh;
  fresh.structure.swap(h->structure);
  fresh.free_directions.swap(h->free_directions);
  fresh.left_out.swap(h->left_out);
  fresh.circles.swap(h->circles);
  fresh.pencils.swap(h->pencils);
  *h = std::move(fresh);
  h->free_directions.clear();
  h->left_out.clear();
  h->cam_from_world = state.Pose(map);
  h->probability = std::exp(state.log_weight);
  h->metric = map.metric;
  h->origin_observed = map.origin_observed;
  h->structure = map.plane;
  FillCovariance(map, state, h);
  FillLandmarks(map, state, camera, h);
  FillCamera(map, state, camera, h);
}

void FillFrame(const TrackFrame& frame, const TrackFit& fit, PoseHypothesis* h,
               std::vector<std::string>* notes, std::vector<double>* distances) {
  h->cost = fit.cost;
  double squares = 0.0;
  const double* parameters[kMostBlocks];
  for (std::size_t i = 0; i < frame.terms().size(); ++i) {
    const TrackFrame::Term& term = frame.terms()[i];
    if (fit.active[i] == 0) {
      if (term.parent >= 0 && fit.active[static_cast<std::size_t>(term.parent)] == 0) continue;
      h->left_out.push_back(term.id);
      if (notes != nullptr)
        notes->push_back(term.Name() + ": left out, it contradicts the pose found");
      continue;
    }
    const ImagePoints* points = term.cost->points();
    if (points == nullptr) continue;
    frame.Parameters(term, fit.state.x.data(), fit.own.data(), parameters);
    term.cost->Distances(parameters, distances);
    h->num_observations += static_cast<int>(distances->size());
    for (const double d : *distances) {
      if (!(std::abs(d) <= kInlierSigmas * points->options().sigma_px)) continue;
      ++h->num_inliers;
      squares += d * d;
    }
  }
  h->rms_px = h->num_inliers > 0 ? std::sqrt(squares / h->num_inliers) : 0.0;
  for (const std::string& id : h->left_out) h->structure += " - " + id;
}

}  // namespace circline
