#include "circline/ransac/detection/structure/right_angled_axes.h"

#include <Eigen/Geometry>
#include <cmath>

namespace circline {

using Eigen::Vector2d;
using Eigen::Vector3d;

// With y = u cos t + v sin t, x is along a x y, and x x y, which is along (a . y) y - a, at right
// angles to c where (a . y) (c . y) = a . c: a quadratic equation in tan t.
std::vector<Eigen::Matrix3d> RightAngledAxes(const Vector3d& a, const Vector3d& b,
                                             const Vector3d& c) {
  const Vector3d u = b.unitOrthogonal(), v = b.cross(u);
  const double au = a.dot(u), av = a.dot(v), cu = c.dot(u), cv = c.dot(v), ac = a.dot(c);
  // p tan^2 + q tan + r = 0
  const double p = av * cv - ac, q = au * cv + av * cu, r = au * cu - ac;
  const double discriminant = q * q - 4.0 * p * r;
  std::vector<Eigen::Matrix3d> rotations;
  if (!(discriminant >= 0.0)) return rotations;
  const double half = -0.5 * (q + std::copysign(std::sqrt(discriminant), q));
  for (const Vector2d& tangent : {Vector2d(p, half), Vector2d(half, r)}) {  // cos : sin
    const Vector3d y = (tangent.x() * u + tangent.y() * v).normalized(),
                   x = a.cross(y).normalized();
    const Vector3d z = x.cross(y);
    // Not so where a line repeats another.
    if (std::abs(z.norm() - 1.0) < 1e-6)
      rotations.emplace_back((Eigen::Matrix3d() << x, y, z).finished());
  }
  return rotations;
}

}  // namespace circline
