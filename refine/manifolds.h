// Manifolds of parameter blocks that ceres has none for. Internal: not installed.
#ifndef CIRCLINE_REFINE_MANIFOLDS_H_
#define CIRCLINE_REFINE_MANIFOLDS_H_

#include <ceres/manifold.h>

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
class InPlaneManifold : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 3; }
  int TangentSize() const override { return 1; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

// Vectors of three, scaled by exp(delta).
class ScaleManifold : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 3; }
  int TangentSize() const override { return 1; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override;
  bool PlusJacobian(const double* x, double* jacobian) const override;
  bool Minus(const double* y, const double* x, double* y_minus_x) const override;
  bool MinusJacobian(const double* x, double* jacobian) const override;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_MANIFOLDS_H_
