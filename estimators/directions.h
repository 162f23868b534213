// Unit vectors, their errors, and what another camera makes of them. Internal: not installed, but
// shown to the other libraries.
#ifndef CIRCLINE_ESTIMATORS_DIRECTIONS_H_
#define CIRCLINE_ESTIMATORS_DIRECTIONS_H_

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "circline/estimators/basics.h"
#include "circline/estimators/camera.h"

namespace circline {

// Two unit vectors across `unit` and each other: right-handed with it.
inline Eigen::Matrix<double, 3, 2> BasisAcross(const Eigen::Vector3d& unit) {
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = unit.unitOrthogonal();
  basis.col(1) = unit.cross(basis.col(0));
  return basis;
}

// The largest standard deviation of a direction of this covariance, radians; degrees.
inline double LargestSigma(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, eigen.eigenvalues()[2]));
}
inline double LargestSigmaDeg(const Eigen::Matrix3d& covariance) {
  return LargestSigma(covariance) / kDegree;
}

// Takes calibrated coordinates, and directions but for their length, of one camera to those of
// another that sees the same pixels; lenses left out.
inline Eigen::Matrix3d ChangeOfCamera(const Camera& from, const Camera& to) {
  Eigen::Matrix3d change = Eigen::Matrix3d::Identity();
  change.diagonal().head<2>() << from.fx / to.fx, from.fy / to.fy;
  change.col(2).head<2>() << (from.cx - to.cx) / to.fx, (from.cy - to.cy) / to.fy;
  return change;
}

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_DIRECTIONS_H_
