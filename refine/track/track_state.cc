#include "circline/refine/track/track_state.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "circline/refine/block_chain.h"
#include "circline/refine/manifolds.h"

namespace circline {
namespace {

// d exp(v) = exp(v) at the left: exp([v + dv]x) = exp([J dv]x) exp([v]x), to second order in v.
Eigen::Matrix3d LeftJacobian(const Eigen::Vector3d& v) {
  const Eigen::Matrix3d V = CrossMatrix(v);
  const double angle = v.norm();
  constexpr double kSmall = 1e-4;
  if (angle < kSmall) return Eigen::Matrix3d::Identity() + 0.5 * V + V * V / 6.0;
  return Eigen::Matrix3d::Identity() + (1.0 - std::cos(angle)) / (angle * angle) * V +
         (angle - std::sin(angle)) / (angle * angle * angle) * V * V;
}

// Of pose and velocities, which come first.
using MotionMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, 12, 12>;

// Kalman's update by a measurement z = J x + noise of the pose, whose tangents come first: x moves
// by K z.
void KalmanUpdate(const TrackMap& map, const BlockMatrix& J, const BlockVector& z,
                  const BlockMatrix& noise, Scratch* scratch, TrackState* state) {
  const Scratch::Scope scope(scratch);
  Eigen::MatrixXd& P = state->covariance;
  Scratch::Matrix JP = scratch->NewMatrix(J.rows(), P.cols()),
                  gain = scratch->NewMatrix(J.rows(), P.cols());
  JP.noalias() = J * P.topRows(J.cols());
  BlockMatrix root = noise;
  root.noalias() += JP.leftCols(J.cols()) * J.transpose();
  if (!FactorInPlace(root)) return;
  gain = JP;
  SolveInPlace(root, gain);
  BlockMatrix weighed = z;
  SolveInPlace(root, weighed);
  state->log_weight -= 0.5 * (z.dot(weighed.col(0)) + LogDetOfRoot(root));
  P.noalias() -= JP.transpose() * gain;
  Symmetrize(&P);
  Scratch::Vector step = scratch->NewVector(P.cols());
  step.noalias() = gain.transpose() * z;
  state->Move(map, step);
}

}  // namespace

void TrackMap::Reset(bool has_position, const Camera& camera, const CameraSigma& sigma,
                     bool is_told) {
  *this = TrackMap();
  AddBlock(4, std::make_unique<WorldRotationManifold<3>>());
  AddBlock(3, {}, !has_position);
  AddBlock(3);
  AddBlock(3, {}, !has_position);
  std::unique_ptr<ceres::Manifold> manifold = ShiftManifold(ShiftSigmas(camera, sigma));
  const bool is_exact = manifold == nullptr;
  camera_is_unknown = sigma.IsEstimated();
  camera_is_considered = !camera_is_unknown || !is_told;
  AddBlock(kCameraSize, std::move(manifold), is_exact);
}

int TrackMap::AddBlock(int size, std::unique_ptr<ceres::Manifold> manifold, bool is_constant) {
  const int index = Graph::AddBlock(size, {}, std::move(manifold), is_constant);
  tangents_.push_back(tangent_size_);
  tangent_size_ += block(index).tangent_size();
  return index;
}

CameraPose TrackState::Pose(const TrackMap& map) const {
  return {RotationFromBlock(x.data() + map.block(TrackMap::kRotation).offset),
          Vector(map, TrackMap::kTranslation)};
}

void TrackState::SetPose(const TrackMap& map, const CameraPose& pose) {
  Eigen::Map<Eigen::Quaterniond> q(x.data() + map.block(TrackMap::kRotation).offset);
  const Eigen::Quaterniond moved = Eigen::Quaterniond(pose.rotation).normalized();
  // The same sense as before: charts are linear in it.
  q = moved.dot(q) < 0.0 ? Eigen::Quaterniond(-moved.coeffs()) : moved;
  Eigen::Map<Eigen::Vector3d>(x.data() + map.block(TrackMap::kTranslation).offset) =
      pose.translation;
}

bool TrackState::IsInRange() const {
  constexpr double kRange = 1e100;
  return x.cwiseAbs().maxCoeff() < kRange && covariance.cwiseAbs().maxCoeff() < kRange;
}

void TrackState::Append(const TrackMap& map, int index, const double* values,
                        const Eigen::MatrixXd& block_covariance) {
  const Block& block = map.block(index);
  x.conservativeResize(block.offset + block.size);
  std::copy(values, values + block.size, x.data() + block.offset);
  const Eigen::Index before = covariance.rows(), more = block.tangent_size();
  covariance.conservativeResize(before + more, before + more);
  covariance.rightCols(more).setZero();
  covariance.bottomRows(more).setZero();
  covariance.bottomRightCorner(more, more) = block_covariance;
}

void TrackState::Append(const TrackMap& map, int index, const Eigen::VectorXd& values,
                        const Eigen::VectorXd& sigmas) {
  const Eigen::VectorXd variances = sigmas.head(map.block(index).tangent_size()).cwiseAbs2();
  Append(map, index, values.data(), Eigen::MatrixXd(variances.asDiagonal()));
}

double SquaredDistance(const CameraPose& from, const CameraPose& to, BlockMatrix covariance) {
  BlockMatrix e(covariance.rows(), 1);
  e.topRows<3>() = LogRotation(from.rotation.transpose() * to.rotation);
  if (e.rows() == 6) e.bottomRows<3>() = to.translation - from.translation;
  if (!FactorInPlace(covariance)) return std::numeric_limits<double>::infinity();
  HalfSolveInPlace(covariance, e);
  return e.squaredNorm();
}

void TrackState::Move(const TrackMap& map, const Scratch::Vector& step) {
  BlockVector moved;
  for (int i = 0; i < map.size(); ++i) {
    const Block& block = map.block(i);
    if (block.tangent_size() == 0) continue;
    double* values = x.data() + block.offset;
    Eigen::Map<Eigen::VectorXd> all(values, block.size);
    const double* by = step.data() + map.tangent(i);
    if (block.manifold == nullptr) {
      all += Eigen::Map<const Eigen::VectorXd>(by, block.size);
      continue;
    }
    moved.resize(block.size);
    block.manifold->Plus(values, by, moved.data());
    all = moved;
  }
}

// X_cam moves as R' = exp([w dt]x) R, t' = exp([w dt]x) t + V v dt: a constant twist (w, v). Its
// noise is a random walk of w and v, integrated over dt.
void MoveOn(const TrackMap& map, const TrackerOptions& options, double dt, TrackState* state) {
  if (!(dt > 0.0)) return;
  using M = TrackMap;
  const CameraPose pose = state->Pose(map);
  const Eigen::Vector3d turn = dt * state->Vector(map, M::kTurnRate);
  const Eigen::Matrix3d E = ExpRotation(turn), V = LeftJacobian(turn);
  CameraPose moved = {E * pose.rotation, pose.translation};
  if (map.has_position()) {
    moved.translation = E * pose.translation + V * (dt * state->Vector(map, M::kVelocity));
  }
  state->SetPose(map, moved);

  // d pose = dt B d(w, v), and V of each. The shift is turned half as far as what it starts from.
  Matrix6d B = Matrix6d::Identity(), VV = Matrix6d::Zero();
  B.topLeftCorner<3, 3>() = moved.rotation.transpose();
  B.bottomLeftCorner<3, 3>() = -CrossMatrix(0.5 * (E * pose.translation + moved.translation));
  VV.topLeftCorner<3, 3>() = VV.bottomRightCorner<3, 3>() = V;
  Vector6d variances;  // Of the change of (w, v).
  const double velocity_sigma = options.velocity_sigma * pose.translation.norm();
  variances << Eigen::Vector3d::Constant(options.turn_rate_sigma * options.turn_rate_sigma * dt),
      Eigen::Vector3d::Constant(velocity_sigma * velocity_sigma * dt);
  const Matrix6d BV = dt * B * VV, BW = B * variances.asDiagonal();
  const Matrix6d BWB = BW * B.transpose();

  // F of the pose, its first rows, and the velocities; it is the identity for all that follows.
  // Without a position the turns alone are there.
  const int m = map.tangent(M::kTurnRate), n = map.tangent(M::kCamera);
  MotionMatrix F = MotionMatrix::Identity(n, n), Q(n, n);
  if (map.has_position()) F.block<3, 3>(3, 3) = E;
  F.topRightCorner(m, m) = BV.topLeftCorner(m, m);
  Q.topLeftCorner(m, m) = dt * dt / 3.0 * BWB.topLeftCorner(m, m);
  Q.topRightCorner(m, m) = 0.5 * dt * BW.topLeftCorner(m, m);
  Q.bottomLeftCorner(m, m) = Q.topRightCorner(m, m).transpose();
  Q.bottomRightCorner(m, m) = variances.head(m).asDiagonal();
  Eigen::MatrixXd& P = state->covariance;
  for (Eigen::Index k = 0; k < P.cols(); ++k) {
    const BlockVector column = P.col(k).head(n);
    P.col(k).head(n).noalias() = F * column;
  }
  for (Eigen::Index k = 0; k < P.rows(); ++k) {
    const BlockVector row = P.row(k).head(n).transpose();
    P.row(k).head(n).noalias() = (F * row).transpose();
  }
  P.topLeftCorner(n, n) += Q;
}

// The motion is a measurement of the velocities between the frames: it takes their place, and they
// take the pose on without noise of their own.
void MoveBy(const TrackMap& map, const TrackerOptions& options, const RelativePose& motion,
            double dt, TrackState* state) {
  using M = TrackMap;
  constexpr double kShortest = 1e-6;  // Finer than cameras' clocks: less makes rates without bound.
  const double seconds = std::max(dt, kShortest), rate = 1.0 / seconds;
  const Eigen::Vector3d turn = LogRotation(motion.now_from_before.rotation);
  const Eigen::Matrix3d inverse = LeftJacobian(turn).inverse();
  const bool has_shift = map.has_position() && motion.has_translation;
  Eigen::MatrixXd& P = state->covariance;
  const int first = map.tangent(M::kTurnRate), rows = has_shift ? 6 : 3;
  P.middleRows(first, rows).setZero();
  P.middleCols(first, rows).setZero();
  Matrix6d T = Matrix6d::Zero();
  T.topLeftCorner<3, 3>() = T.bottomRightCorner<3, 3>() = rate * inverse;
  const Matrix6d noise = T * Eigen::Map<const Matrix6d>(motion.covariance.data()) * T.transpose();
  P.block(first, first, rows, rows) = noise.topLeftCorner(rows, rows);
  Eigen::Map<Eigen::Vector3d>(state->x.data() + map.block(M::kTurnRate).offset) = rate * turn;
  if (has_shift) {
    Eigen::Map<Eigen::Vector3d>(state->x.data() + map.block(M::kVelocity).offset) =
        rate * (inverse * motion.now_from_before.translation);
  }
  TrackerOptions exact = options;
  exact.turn_rate_sigma = 0.0;
  if (has_shift) exact.velocity_sigma = 0.0;
  MoveOn(map, exact, seconds, state);
  // Of the velocities to come.
  const double w = options.turn_rate_sigma,
               v = has_shift ? options.velocity_sigma * state->Pose(map).translation.norm() : 0.0;
  P.diagonal().segment<3>(first).array() += w * w * dt;
  if (has_shift) P.diagonal().segment<3>(first + 3).array() += v * v * dt;
}

void Condition(const TrackMap& map, const PosePrior& prior, Scratch* scratch, TrackState* state) {
  const CameraPose pose = state->Pose(map);
  const int rows = map.has_position() ? 6 : 3;
  BlockMatrix J = BlockMatrix::Zero(rows, rows);
  J.topLeftCorner<3, 3>() = pose.rotation;
  BlockVector z(rows);
  z.head<3>() = LogRotation(prior.mean.rotation * pose.rotation.transpose());
  if (rows == 6) {
    J.bottomRightCorner<3, 3>().setIdentity();
    z.tail<3>() = prior.mean.translation - pose.translation;
  }
  const Eigen::Map<const Matrix6d> noise(prior.covariance.data());
  KalmanUpdate(map, J, z, noise.topLeftCorner(rows, rows), scratch, state);
}

void Condition(const TrackMap& map, const GravityPrior& prior, Scratch* scratch,
               TrackState* state) {
  const Eigen::Matrix3d R = state->Pose(map).rotation;
  const Eigen::Matrix3d J = -R * CrossMatrix(prior.in_world);
  const Eigen::Matrix3d noise = prior.sigma_rad * prior.sigma_rad * Eigen::Matrix3d::Identity();
  KalmanUpdate(map, J, prior.in_camera - R * prior.in_world, noise, scratch, state);
}

}  // namespace circline
