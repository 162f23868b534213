// Conics in calibrated coordinates: symmetric 3x3 matrices C with (x, y, 1) C (x, y, 1)^T = 0.
#ifndef CIRCLINE_ESTIMATORS_CONIC_H_
#define CIRCLINE_ESTIMATORS_CONIC_H_

#include <Eigen/Core>
#include <array>

#include "circline/estimators/camera.h"
#include "circline/estimators/export.h"

namespace CIRCLINE_EXPORT circline {

// Six numbers: of a conic (ConicToVector), or [delta, delta_t] of a pose; and their covariance.
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

// The six free entries of a conic in an order and scale that keep the Frobenius norm:
// (C00, C11, C22, sqrt2 C01, sqrt2 C02, sqrt2 C12).
Vector6d ConicToVector(const Eigen::Matrix3d& conic);
Eigen::Matrix3d VectorToConic(const Vector6d& v);

// Unit Frobenius norm, and the sign that makes the signature of an ellipse (+, +, -): the conic is
// then negative inside. Returns false, with `normalized` untouched, for anything that is not the
// image of a circle in front of the camera as an ellipse: non-finite, degenerate or imaginary
// (definite) conics, hyperbolas and parabolas.
bool NormalizeEllipse(const Eigen::Matrix3d& conic, Eigen::Matrix3d* normalized);

// An ellipse by its axes, in the plane and the unit of the conic that it is of.
struct Ellipse {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();  // Where the axes cross.
  double a = 0.0, b = 0.0;                           // Semi-axes, a >= b > 0.
  double angle = 0.0;  // Of the major axis from +x towards +y, radians, in (-pi/2, pi/2].
};

// Between a conic and the parameters of an ellipse, in whatever plane (calibrated or pixels).
// ConicToEllipse returns false where NormalizeEllipse does.
bool ConicToEllipse(const Eigen::Matrix3d& conic, Ellipse* ellipse);
Eigen::Matrix3d EllipseToConic(const Ellipse& ellipse);
// The point of the ellipse at parameter t (eccentric anomaly), radians.
Eigen::Vector2d EllipsePoint(const Ellipse& ellipse, double t);

// The conic after the affine change of coordinates x = A u: u^T (A^T C A) u = 0.
Eigen::Matrix3d TransformConic(const Eigen::Matrix3d& conic, const Eigen::Matrix3d& x_from_u);

// Distance of a point to a conic, signed (negative inside an ellipse), pixels of the photo, first
// order (Sampson). 0 where the gradient vanishes would hide an outlier, so the centre of the conic
// yields infinity.
double ConicDistancePx(const CalibratedPoint& p, const Eigen::Matrix3d& conic);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_CONIC_H_
