// The least squares of what one plane shows, linearised. Internal: not installed.
#ifndef CIRCLINE_ESTIMATORS_PLANE_EQUATIONS_H_
#define CIRCLINE_ESTIMATORS_PLANE_EQUATIONS_H_

#include <Eigen/Core>

#include "circline/estimators/plane_focal.h"

namespace circline {

// Unknowns, in the order of a step: log focal length, normal (2, in the tangent plane), log unit.
struct PlaneState {
  double log_focal = 0.0;
  Eigen::Matrix3d basis = Eigen::Matrix3d::Identity();  // Two directions of the plane, its normal.
  double log_unit = 0.0;                                // Of the radii, on the plane n . X = 1.

  // The normal, and the radius of this circle as the unit; false where it would be none there.
  bool Set(const Eigen::Vector3d& normal, const Eigen::Matrix3d& conic);
  void Step(const Eigen::Vector4d& step);
};

struct PlaneEquations {
  Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
  Eigen::Vector4d gradient = Eigen::Vector4d::Zero();
  // Of the gradient, per shift of the principal point.
  Eigen::Matrix<double, 4, 2> shift = Eigen::Matrix<double, 4, 2>::Zero();
  double chi2 = 0.0;

  // False where a circle is none on that plane.
  bool Set(const PlaneEvidence& evidence, const PlaneState& state);
};

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_PLANE_EQUATIONS_H_
