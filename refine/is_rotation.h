// Whether what a caller hands over is a rotation. Internal: not installed.
#ifndef CIRCLINE_REFINE_IS_ROTATION_H_
#define CIRCLINE_REFINE_IS_ROTATION_H_

#include <Eigen/Core>
#include <Eigen/LU>

namespace circline {

inline bool IsRotation(const Eigen::Matrix3d& R) {
  constexpr double kTolerance = 1e-6;
  return (R * R.transpose()).isIdentity(kTolerance) && R.determinant() > 0.0;
}

}  // namespace circline

#endif  // CIRCLINE_REFINE_IS_ROTATION_H_
