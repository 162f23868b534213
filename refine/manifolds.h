// Manifolds of parameter blocks that ceres has none for. Internal: not installed.
#ifndef CIRCLINE_REFINE_MANIFOLDS_H_
#define CIRCLINE_REFINE_MANIFOLDS_H_

#include <ceres/autodiff_manifold.h>
#include <ceres/rotation.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace circline {

// Angle times axis.
template <typename T>
Eigen::Matrix<T, 3, 1> AngleAxisOf(const Eigen::Quaternion<T>& q) {
  const T by_ceres[4] = {q.w(), q.x(), q.y(), q.z()};
  Eigen::Matrix<T, 3, 1> angle_axis;
  ceres::QuaternionToAngleAxis(by_ceres, angle_axis.data());
  return angle_axis;
}

// Unit quaternions (x, y, z, w), perturbed in the world: R exp([delta]x). With two tangent
// dimensions the spin about the world's Z axis is held.
template <int kTangentSize>
struct TurnOfWorld {
  template <typename T>
  using Quaternion = Eigen::Quaternion<T>;

  template <typename T>
  bool Plus(const T* x, const T* delta, T* x_plus_delta) const {
    T angle_axis[3] = {static_cast<T>(0.0), static_cast<T>(0.0), static_cast<T>(0.0)}, turn[4];
    std::copy(delta, delta + kTangentSize, angle_axis);
    ceres::AngleAxisToQuaternion(angle_axis, turn);
    Eigen::Map<Quaternion<T>> sum(x_plus_delta);
    sum = Eigen::Map<const Quaternion<T>>(x) * Quaternion<T>(turn[0], turn[1], turn[2], turn[3]);
    sum.normalize();
    return true;
  }
  template <typename T>
  bool Minus(const T* y, const T* x, T* y_minus_x) const {
    const Eigen::Matrix<T, 3, 1> turn = AngleAxisOf<T>(
        Eigen::Map<const Quaternion<T>>(x).conjugate() * Eigen::Map<const Quaternion<T>>(y));
    std::copy(turn.data(), turn.data() + kTangentSize, y_minus_x);
    return true;
  }
};
template <int kTangentSize>
using WorldRotationManifold = ceres::AutoDiffManifold<TurnOfWorld<kTangentSize>, 4, kTangentSize>;

// Unit vectors of the plane z = 0, turned about z.
struct TurnInPlane {
  template <typename T>
  bool Plus(const T* x, const T* delta, T* x_plus_delta) const {
    using std::cos;
    using std::sin;
    const T c = cos(delta[0]), s = sin(delta[0]);
    x_plus_delta[0] = c * x[0] - s * x[1];
    x_plus_delta[1] = s * x[0] + c * x[1];
    x_plus_delta[2] = static_cast<T>(0.0);
    return true;
  }
  template <typename T>
  bool Minus(const T* y, const T* x, T* y_minus_x) const {
    using std::atan2;
    y_minus_x[0] = atan2(x[0] * y[1] - x[1] * y[0], x[0] * y[0] + x[1] * y[1]);
    return true;
  }
};
using InPlaneManifold = ceres::AutoDiffManifold<TurnInPlane, 3, 1>;

// Vectors of three, scaled by exp(delta).
struct Scaling {
  template <typename T>
  bool Plus(const T* x, const T* delta, T* x_plus_delta) const {
    using std::exp;
    // A step that no start is so far off as to need; a longer one would leave the range of numbers,
    // and Ceres print what it cannot evaluate there.
    const T most = static_cast<T>(100.0);
    const T factor = exp(delta[0] > most ? most : delta[0] < -most ? -most : delta[0]);
    for (int k = 0; k < 3; ++k) x_plus_delta[k] = factor * x[k];
    return true;
  }
  template <typename T>
  bool Minus(const T* y, const T* x, T* y_minus_x) const {
    using std::log;
    y_minus_x[0] = 0.5 * log(ceres::DotProduct(y, y) / ceres::DotProduct(x, x));
    return true;
  }
};
using ScaleManifold = ceres::AutoDiffManifold<Scaling, 3, 1>;

}  // namespace circline

#endif  // CIRCLINE_REFINE_MANIFOLDS_H_
