// Distances of a measured point to a line or conic, with derivatives: the residuals of the direct
// fits and of the joint refinement alike.
//
// In pixels of the photo as taken, through the camera's local Jacobian (CalibratedPoint), and
// homogeneous of degree 0 in the curve, so that its scale is no parameter. To lines the distance is
// exact there, to conics either of first order (Sampson: f / |grad f|) or orthogonal. Hand-written
// derivatives: a third of the time of automatic ones.
#ifndef CIRCLINE_ESTIMATORS_GEOMETRIC_RESIDUALS_H_
#define CIRCLINE_ESTIMATORS_GEOMETRIC_RESIDUALS_H_

#include <Eigen/Core>

#include "circline/estimators/basics.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/conic.h"
#include "circline/estimators/export.h"
#include "circline/estimators/foot_points.h"

namespace CIRCLINE_EXPORT circline {

// Gradient of |GradientPerPixel(g)| with respect to g, given h = GradientPerPixel(g) / |...|.
inline Eigen::Vector2d NormGradient(const CalibratedPoint& p, const Eigen::Vector2d& h) {
  return {p.x_from_pixel[0] * h.x() + p.x_from_pixel[1] * h.y(),
          p.x_from_pixel[2] * h.x() + p.x_from_pixel[3] * h.y()};
}

// Signed distance of p to the line l . (x, y, 1) = 0, pixels; `jacobian` = d distance / d l.
inline double LineDistance(const CalibratedPoint& p, const Eigen::Vector3d& line,
                           Eigen::Vector3d* jacobian) {
  const Eigen::Vector2d g = p.GradientPerPixel(line.head<2>());
  const double norm = g.norm();
  const double r = line.dot(p.Homogeneous()) / norm;
  *jacobian = p.Homogeneous() / norm;
  jacobian->head<2>() -= (r / norm) * NormGradient(p, g / norm);
  return r;
}

// Signed distance of p to the conic C, pixels, negative inside a normalised ellipse; `jacobian` =
// d distance / d ConicToVector(C).
inline double ConicDistance(const CalibratedPoint& p, const Eigen::Matrix3d& C,
                            Vector6d* jacobian) {
  const double x = p.x.x(), y = p.x.y();
  const Eigen::Vector3d polar = C * p.Homogeneous();
  const Eigen::Vector2d g = p.GradientPerPixel(polar.head<2>());
  const double norm = g.norm();
  const double half = 0.5 / norm;  // grad f = 2 polar.
  const double r = (x * polar.x() + y * polar.y() + polar.z()) * half;
  const Eigen::Vector2d d = (r / norm) * NormGradient(p, g / norm);
  *jacobian << x * (x * half - d.x()), y * (y * half - d.y()), half,
      kSqrt2 * x * y * half - (d.x() * y + d.y() * x) / kSqrt2, kSqrt2 * x * half - d.x() / kSqrt2,
      kSqrt2 * y * half - d.y() / kSqrt2;
  return r;
}

// The same, orthogonally, to an ellipse C of positive diagonal; `level` = EllipseLevel(C). The
// jacobian may be null; `normal` (optional) receives the ellipse's outward one at the nearest
// point, in the photo: d distance / d pixel.
inline double OrthogonalDistance(const CalibratedPoint& p, const Eigen::Matrix3d& C, double level,
                                 Vector6d* jacobian, Eigen::Vector2d* normal = nullptr) {
  using Lane = FootPoints<1>::Lanes;
  const auto lane = [](double value) { return Lane::Constant(value); };
  const FootPoints<1> foot =
      FindFootPoints<1>({lane(p.x.x()), lane(p.x.y()), lane(p.x_from_pixel[0]),
                         lane(p.x_from_pixel[1]), lane(p.x_from_pixel[2]), lane(p.x_from_pixel[3])},
                        C, level);
  if (jacobian != nullptr) {
    const double x = foot.x[0], y = foot.y[0];
    *jacobian << x * x, y * y, 1.0, kSqrt2 * x * y, kSqrt2 * x, kSqrt2 * y;
    *jacobian *= foot.inverse_gradient[0];
  }
  if (normal != nullptr) {
    const Eigen::Vector3d x(foot.x[0], foot.y[0], 1.0);
    *normal = p.GradientPerPixel((C * x).head<2>()).normalized();
  }
  return foot.distance[0];
}

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_GEOMETRIC_RESIDUALS_H_
