#include "circline/refine/manifolds.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "circline/estimators/pose.h"
#include "circline/refine/block_chain.h"

namespace circline {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using ConstQuaternion = Eigen::Map<const Eigen::Quaterniond>;
using ConstVector = Eigen::Map<const Eigen::Vector3d>;

}  // namespace

bool WorldRotationManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  Eigen::Vector3d d = Eigen::Vector3d::Zero();
  std::copy(delta, delta + tangent_size_, d.data());
  const double half = 0.5 * d.norm();
  const double sinc = half > 1e-4 ? std::sin(half) / (2.0 * half) : 0.5 - half * half / 12.0;
  const Eigen::Quaterniond turn(std::cos(half), sinc * d.x(), sinc * d.y(), sinc * d.z());
  Eigen::Map<Eigen::Quaterniond> result(x_plus_delta);
  result = (ConstQuaternion(x) * turn).normalized();
  return true;
}

bool WorldRotationManifold::PlusJacobian(const double* x, double* jacobian) const {
  // d (q exp(delta)) = q (delta / 2): the transpose of DeltaFromQuaternion, a quarter of it.
  const Eigen::Matrix<double, 4, 3> J = 0.25 * DeltaFromQuaternion(x).transpose();
  Eigen::Map<RowMajor>(jacobian, 4, tangent_size_) = J.leftCols(tangent_size_);
  return true;
}

bool WorldRotationManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  const Eigen::Vector3d d =
      LogRotation((ConstQuaternion(x).conjugate() * ConstQuaternion(y)).toRotationMatrix());
  std::copy(d.data(), d.data() + tangent_size_, y_minus_x);
  return true;
}

bool WorldRotationManifold::MinusJacobian(const double* x, double* jacobian) const {
  Eigen::Map<RowMajor>(jacobian, tangent_size_, 4) = DeltaFromQuaternion(x).topRows(tangent_size_);
  return true;
}

bool InPlaneManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  const double angle = std::atan2(x[1], x[0]) + delta[0];
  x_plus_delta[0] = std::cos(angle);
  x_plus_delta[1] = std::sin(angle);
  x_plus_delta[2] = 0.0;
  return true;
}

bool InPlaneManifold::PlusJacobian(const double* x, double* jacobian) const {
  jacobian[0] = -x[1];
  jacobian[1] = x[0];
  jacobian[2] = 0.0;
  return true;
}

bool InPlaneManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  y_minus_x[0] = std::atan2(x[0] * y[1] - x[1] * y[0], x[0] * y[0] + x[1] * y[1]);
  return true;
}

bool InPlaneManifold::MinusJacobian(const double* x, double* jacobian) const {
  return PlusJacobian(x, jacobian);
}

bool ScaleManifold::Plus(const double* x, const double* delta, double* x_plus_delta) const {
  // A step that no start is so far off as to need; a longer one would leave the range of numbers,
  // and Ceres print what it cannot evaluate there.
  constexpr double kMost = 100.0;
  const double factor = std::exp(std::clamp(delta[0], -kMost, kMost));
  for (int k = 0; k < 3; ++k) x_plus_delta[k] = factor * x[k];
  return true;
}

bool ScaleManifold::PlusJacobian(const double* x, double* jacobian) const {
  std::copy(x, x + 3, jacobian);
  return true;
}

bool ScaleManifold::Minus(const double* y, const double* x, double* y_minus_x) const {
  y_minus_x[0] = std::log(ConstVector(y).norm() / ConstVector(x).norm());
  return true;
}

bool ScaleManifold::MinusJacobian(const double* x, double* jacobian) const {
  Eigen::Map<Eigen::RowVector3d> out(jacobian);
  out = ConstVector(x).transpose() / ConstVector(x).squaredNorm();
  return true;
}

}  // namespace circline
