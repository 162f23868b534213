// Manifolds of parameter blocks that ceres has none for. Internal: not installed.
#ifndef CIRCLINE_REFINE_MANIFOLDS_H_
#define CIRCLINE_REFINE_MANIFOLDS_H_

#include <ceres/autodiff_manifold.h>
#include <ceres/manifold.h>
#include <ceres/rotation.h>

#include <cmath>

namespace circline {

// Unit quaternions (x, y, z, w), perturbed in the world: R exp([delta]x). With two tangent
// dimensions the spin about the world's Z axis is held.
class WorldRotationManifold : public ceres::Manifold {
 public:
  explicit WorldRotationManifold(int tangent_size) : tangent_size_(tangent_size) {}
  int AmbientSize() const override { return 4; }
  int TangentSize() const override { return tangent_size_; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;

 private:
  int tangent_size_;
};

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
