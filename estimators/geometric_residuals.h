// Distances of a measured point to a line or conic, with derivatives: the residuals of the direct
// fits and of the joint refinement alike.
//
// Both are first-order (Sampson) distances f / |grad f| in pixels of the photo as taken: the
// gradient goes through the camera's local Jacobian (CalibratedPoint::GradientPerPixel), and both
// are homogeneous of degree 0 in the curve, so that its scale is no parameter. Hand-written
// derivatives: a third of the time of automatic ones.
#ifndef CIRCLINE_ESTIMATORS_GEOMETRIC_RESIDUALS_H_
#define CIRCLINE_ESTIMATORS_GEOMETRIC_RESIDUALS_H_

#include <Eigen/Core>

#include "circline/estimators/camera.h"
#include "circline/estimators/conic.h"

namespace circline {

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
  constexpr double kSqrt2 = 1.4142135623730951;
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

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_GEOMETRIC_RESIDUALS_H_
