// Unit vectors and their errors. Internal: not installed, but shown to the other libraries.
#ifndef CIRCLINE_ESTIMATORS_DIRECTIONS_H_
#define CIRCLINE_ESTIMATORS_DIRECTIONS_H_

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "circline/estimators/basics.h"

namespace circline {

// Two unit vectors across `unit` and each other: right-handed with it.
inline Eigen::Matrix<double, 3, 2> BasisAcross(const Eigen::Vector3d& unit) {
  Eigen::Matrix<double, 3, 2> basis;
  basis.col(0) = unit.unitOrthogonal();
  basis.col(1) = unit.cross(basis.col(0));
  return basis;
}

// The largest standard deviation of a direction of this covariance, degrees.
inline double LargestSigmaDeg(const Eigen::Matrix3d& covariance) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(0.0, eigen.eigenvalues()[2])) / kDegree;
}

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_DIRECTIONS_H_
