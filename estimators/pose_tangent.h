// Covariances of poses for other libraries: how a small change [delta, delta_t] of a pose reads
// there.
//
//     const Matrix6d J = TangentJacobian(h.cam_from_world, kGtsamPose3);
//     const Matrix6d covariance = J * h.Covariance() * J.transpose();
//
// Here a pose is cam_from_world, T = (R, t), and its change that of PoseHypothesis::covariance:
// R = exp([delta]x) R^, t = t^ + delta_t. Libraries with Lie groups move rotation and translation
// together, T = exp(xi) T^ (left) or T^ exp(xi) (right), xi a twist of a rotation omega and a
// translation v, exp that of the 4x4 matrix [[omega]x, v; 0, 0]. To first order, comparing the two:
//
//   of           side   omega         v
//   T            left   delta         delta_t + t^ x delta
//   T            right  R^^T delta    R^^T delta_t
//   T^-1         left   -R^^T delta   -R^^T delta_t
//   T^-1         right  -delta        -(delta_t + t^ x delta)
//
// That is [omega, v] = A [delta, delta_t] with A = [I, 0; [t^]x, I] for T on the left; the adjoint
// of T^^-1 before it for T on the right; and since (exp(xi) T^)^-1 = T^^-1 exp(-xi), the inverse
// has the other side and the other sign.
#ifndef CIRCLINE_ESTIMATORS_POSE_TANGENT_H_
#define CIRCLINE_ESTIMATORS_POSE_TANGENT_H_

#include "circline/estimators/conic.h"
#include "circline/estimators/export.h"
#include "circline/estimators/pose.h"

namespace CIRCLINE_EXPORT circline {

// In which coordinates a library states small changes xi of a pose.
struct PoseTangent {
  bool world_from_cam = false;  // The pose that is kept: T^-1, else T.
  bool right = false;           // estimate * exp(xi), else exp(xi) * estimate.
  bool rotation_first = true;   // xi = [omega, v], else [v, omega].
};

// gtsam::Pose3, which is world_from_cam where its cameras and factors use it: retract() is on the
// right, with GTSAM_POSE3_EXPMAP and without (they agree to first order), rotation first.
inline constexpr PoseTangent kGtsamPose3 = {true, true, true};
// Sophus::SE3d cam_from_world, translation first: exp(xi) * T, and T * exp(xi) as Sophus' own
// derivatives (Dx_this_mul_exp_x_at_0) and its manifold for Ceres have it.
inline constexpr PoseTangent kSophusLeft = {false, false, false};
inline constexpr PoseTangent kSophusRight = {false, true, false};

// J: xi = J [delta, delta_t], at the estimate. Covariances become J C J^T, free directions J d (no
// longer of unit length), information matrices J^-T I J^-1; J is always invertible. Where there are
// free directions, or the scale is not known, J C J^T is singular: add what else you know, or use
// the information, before you hand it to a noise model that inverts it.
inline Matrix6d TangentJacobian(const CameraPose& estimate, const PoseTangent& tangent) {
  // Rows [omega, v] of T on one side. T^-1 on the right is T on the left, and the other way round.
  Matrix6d J = Matrix6d::Identity();
  if (tangent.right == tangent.world_from_cam) {
    J.bottomLeftCorner<3, 3>() = CrossMatrix(estimate.translation);
  } else {
    J.topLeftCorner<3, 3>() = J.bottomRightCorner<3, 3>() = estimate.rotation.transpose();
  }
  if (tangent.world_from_cam) J = -J;
  if (!tangent.rotation_first) J.topRows<3>().swap(J.bottomRows<3>());
  return J;
}

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_POSE_TANGENT_H_
