#include "circline/estimators/conic.h"

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "circline/estimators/basics.h"

namespace circline {
Vector6d ConicToVector(const Eigen::Matrix3d& C) {
  Vector6d v;
  v << C(0, 0), C(1, 1), C(2, 2), kSqrt2 * C(0, 1), kSqrt2 * C(0, 2), kSqrt2 * C(1, 2);
  return v;
}

Eigen::Matrix3d VectorToConic(const Vector6d& v) {
  Eigen::Matrix3d C;
  C << v[0], v[3] / kSqrt2, v[4] / kSqrt2,  //
      v[3] / kSqrt2, v[1], v[5] / kSqrt2,   //
      v[4] / kSqrt2, v[5] / kSqrt2, v[2];
  return C;
}

bool NormalizeEllipse(const Eigen::Matrix3d& conic, Eigen::Matrix3d* normalized) {
  const double scale = conic.cwiseAbs().maxCoeff();
  if (!(scale > 0.0) || !std::isfinite(scale)) return false;
  Eigen::Matrix3d C = conic / scale;
  C = 0.5 * (C + C.transpose()).eval();
  C /= C.norm();
  const double trace = C(0, 0) + C(1, 1);
  if (trace < 0.0) C = -C;
  // An ellipse: the quadratic part is definite, and the whole has one eigenvalue of the other sign.
  if (!(C(0, 0) * C(1, 1) - C(0, 1) * C(0, 1) > 0.0) || !(C.determinant() < 0.0)) return false;
  *normalized = C;
  return true;
}

bool ConicToEllipse(const Eigen::Matrix3d& conic, Ellipse* ellipse) {
  Eigen::Matrix3d C;
  if (!NormalizeEllipse(conic, &C)) return false;
  const Eigen::Matrix2d A = C.topLeftCorner<2, 2>();
  const Eigen::Vector2d center = -A.inverse() * C.topRightCorner<2, 1>();
  // In coordinates about the centre the conic is d^T A d = level.
  const double level = -(C(2, 2) + C.topRightCorner<2, 1>().dot(center));
  const double mean = 0.5 * (A(0, 0) + A(1, 1));
  const double difference = 0.5 * (A(0, 0) - A(1, 1));
  const double radius = std::hypot(difference, A(0, 1));
  const double large = mean + radius;
  const double small = A.determinant() / large;  // Without cancellation.
  if (!(level > 0.0) || !(small > 0.0)) return false;
  ellipse->center = center;
  ellipse->a = std::sqrt(level / small);
  ellipse->b = std::sqrt(level / large);
  // Direction of the smaller eigenvalue of A.
  double angle = radius > 0.0 ? 0.5 * std::atan2(-A(0, 1), -difference) : 0.0;
  if (angle <= -0.5 * kPi) angle += kPi;
  ellipse->angle = angle;
  return std::isfinite(ellipse->a) && std::isfinite(ellipse->b) && center.allFinite();
}

Eigen::Matrix3d EllipseToConic(const Ellipse& ellipse) {
  const double c = std::cos(ellipse.angle), s = std::sin(ellipse.angle);
  Eigen::Matrix2d axes;
  axes << c, -s, s, c;
  const Eigen::Matrix2d A =
      axes *
      Eigen::Vector2d(1.0 / (ellipse.a * ellipse.a), 1.0 / (ellipse.b * ellipse.b)).asDiagonal() *
      axes.transpose();
  Eigen::Matrix3d C;
  C.topLeftCorner<2, 2>() = A;
  C.topRightCorner<2, 1>() = -A * ellipse.center;
  C.bottomLeftCorner<1, 2>() = C.topRightCorner<2, 1>().transpose();
  C(2, 2) = ellipse.center.dot(A * ellipse.center) - 1.0;
  return C / C.norm();
}

Eigen::Vector2d EllipsePoint(const Ellipse& ellipse, double t) {
  const double c = std::cos(ellipse.angle), s = std::sin(ellipse.angle);
  const double u = ellipse.a * std::cos(t), v = ellipse.b * std::sin(t);
  return ellipse.center + Eigen::Vector2d(c * u - s * v, s * u + c * v);
}

Eigen::Matrix3d TransformConic(const Eigen::Matrix3d& conic, const Eigen::Matrix3d& x_from_u) {
  return x_from_u.transpose() * conic * x_from_u;
}

double ConicDistancePx(const CalibratedPoint& p, const Eigen::Matrix3d& conic) {
  const Eigen::Vector3d x = p.Homogeneous();
  const Eigen::Vector3d polar = conic * x;
  const double gradient = 2.0 * p.GradientPerPixel(polar.head<2>()).norm();
  if (!(gradient > 0.0)) return std::numeric_limits<double>::infinity();
  return x.dot(polar) / gradient;
}

}  // namespace circline
