// Whether what a caller says of a pose can be: a rotation, a covariance. Internal: not installed.
#ifndef CIRCLINE_REFINE_JOINT_KNOWN_POSE_H_
#define CIRCLINE_REFINE_JOINT_KNOWN_POSE_H_

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>
#include <array>

#include "circline/estimators/conic.h"

namespace circline {

inline bool IsRotation(const Eigen::Matrix3d& R) {
  constexpr double kTolerance = 1e-6;
  return (R * R.transpose()).isIdentity(kTolerance) && R.determinant() > 0.0;
}

inline bool IsPositiveDefinite(const std::array<double, 36>& covariance) {
  const Eigen::Map<const Matrix6d> P(covariance.data());
  return P.allFinite() && Eigen::LLT<Matrix6d>(P).info() == Eigen::Success;
}

}  // namespace circline

#endif  // CIRCLINE_REFINE_JOINT_KNOWN_POSE_H_
