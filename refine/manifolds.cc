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

}  // namespace circline
