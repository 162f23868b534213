#include "circline/ransac/detection/structure/plane_angles.h"

#include <Eigen/Dense>
#include <array>
#include <cmath>

#include "circline/estimators/basics.h"

namespace circline {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// An angle between lines, of those that are whole turns of them apart the one nearest to 0.
double OfLines(double angle) { return std::remainder(angle, kPi); }

}  // namespace

double AnglesInPlane(const UncertainDirection& first, const UncertainDirection& second,
                     const UncertainDirection& third, const CameraError& camera, double second_rad,
                     double third_rad) {
  // Of one direction, of the two that a right angle has.
  constexpr double kLean = kRightAngleSigmaDeg * kDegree / kSqrt2;
  const Vector3d normal = first.direction.cross(second.direction).normalized();
  const Vector3d along = first.direction, across = normal.cross(along);
  Vector3d angles;  // From the first.
  Matrix3d covariance = kLean * kLean * Matrix3d::Identity();
  Eigen::Matrix<double, 3, 2> by_middle;  // What the principal point's error turns them by.
  int row = 0;
  for (const UncertainDirection* v : {&first, &second, &third}) {
    const Vector3d turn = normal.cross(v->direction);  // To where the angle grows.
    angles[row] = std::atan2(across.dot(v->direction), along.dot(v->direction));
    covariance(row, row) += turn.dot(v->covariance * turn);
    by_middle.row(row) = -camera.middle_rad * v->direction.z() * turn.head<2>();
    ++row;
  }
  covariance += by_middle * by_middle.transpose();
  Eigen::Matrix<double, 2, 3> from_first;
  from_first << -1.0, 1.0, 0.0, -1.0, 0.0, 1.0;
  const Matrix2d of_both = from_first * covariance * from_first.transpose();
  const Eigen::LLT<Matrix2d> root(of_both);
  double sum = 0.0;
  for (const double side : {1.0, -1.0}) {
    const Vector2d off(OfLines(angles[1] - side * second_rad),
                       OfLines(angles[2] - side * third_rad));
    sum += std::exp(-0.5 * root.matrixL().solve(off).squaredNorm());
  }
  // Either side is as likely; any way means a density of 1 / pi for each angle.
  return 0.5 * sum * kPi * kPi / (2.0 * kPi * std::sqrt(of_both.determinant()));
}

}  // namespace circline
