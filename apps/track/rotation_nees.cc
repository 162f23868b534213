#include "apps/track/rotation_nees.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>

#include "apps/common/pose_error.h"

namespace circline::apps {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// The smallest turn that takes the estimate to a truth; camera frame, radians.
Vector3d RotationError(const Matrix3d& estimate, const Truth& truth) {
  Vector3d smallest = Vector3d::Constant(1e9);
  for (const Matrix3d& same : SymmetryGroup(truth.symmetry)) {
    const Vector3d error = LogRotation(*truth.rotation * same * estimate.transpose());
    if (error.norm() < smallest.norm()) smallest = error;
  }
  return smallest;
}

// The smallest turn that takes one normal to another, up to sign.
Vector3d NormalError(const Vector3d& estimate, const Vector3d& truth) {
  const Vector3d axis = estimate.cross(truth.dot(estimate) < 0.0 ? Vector3d(-truth) : truth);
  const double sine = axis.norm();
  return sine > 0.0 ? Vector3d(axis * (std::asin(std::min(1.0, sine)) / sine)) : axis;
}

}  // namespace

std::optional<double> RotationNees(const PoseHypothesis& hypothesis, const SceneImage& image) {
  if (!image.truth || !image.truth->rotation || !SigmaNormalDeg(hypothesis)) return std::nullopt;
  const Matrix3d& rotation = hypothesis.cam_from_world.rotation;
  const Vector3d normal = rotation.col(2);
  const bool normal_only = hypothesis.RotationIsFree() || image.truth->symmetry == Symmetry::kAxis;
  const Vector3d error = normal_only ? NormalError(normal, image.truth->rotation->col(2))
                                     : RotationError(rotation, *image.truth);
  Matrix3d covariance = hypothesis.Covariance().topLeftCorner<3, 3>();
  if (normal_only) {  // Nothing of the turn about the normal.
    const Matrix3d across = Matrix3d::Identity() - normal * normal.transpose();
    covariance = across * covariance * across;
  }
  const int degrees = normal_only ? 2 : 3;
  const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(covariance);
  double nees = 0.0;
  for (int k = 3 - degrees; k < 3; ++k) {  // Eigenvalues ascend: what is free comes first.
    const double variance = eigen.eigenvalues()[k];
    if (!(variance > 0.0)) return std::nullopt;
    const double along = eigen.eigenvectors().col(k).dot(error);
    nees += along * along / variance;
  }
  return nees / degrees;
}

}  // namespace circline::apps
