// A circle through points of its own plane. Internal: not installed.
#ifndef CIRCLINE_REFINE_PLANE_CIRCLE_H_
#define CIRCLINE_REFINE_PLANE_CIRCLE_H_

#include <Eigen/Core>
#include <Eigen/LU>
#include <cmath>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/pose.h"

namespace circline {

// Circle of least squares of x^2 + y^2 + .. (Kasa 1976): (cx, cy, r). False for points in line.
inline bool FitPlaneCircle(const std::vector<Eigen::Vector2d>& points, Eigen::Vector3d* circle) {
  const double n = static_cast<double>(points.size());
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& p : points) mean += p / n;
  Eigen::Matrix2d A = Eigen::Matrix2d::Zero();
  Eigen::Vector2d b = Eigen::Vector2d::Zero();
  double squared = 0.0;
  for (const Eigen::Vector2d& p : points) {
    const Eigen::Vector2d d = p - mean;
    A += d * d.transpose();
    b += 0.5 * d.squaredNorm() * d;
    squared += d.squaredNorm() / n;
  }
  constexpr double kInLine = 1e-12;
  if (!(A.determinant() > kInLine * A.trace() * A.trace())) return false;
  const Eigen::Vector2d center = A.inverse() * b;
  *circle << mean + center, std::sqrt(squared + center.squaredNorm());
  return circle->allFinite();
}

// The circle of the plane Z = 0 through calibrated points. False where they do not all lie before
// the camera.
inline bool FitPlaneCircle(const std::vector<CalibratedPoint>& points, const CameraPose& pose,
                           Eigen::Vector3d* circle) {
  const double distance = pose.rotation.col(2).dot(pose.translation);
  std::vector<Eigen::Vector2d> in_plane;
  for (const CalibratedPoint& p : points) {
    const Eigen::Vector3d ray = p.Homogeneous();
    const double depth = distance / pose.rotation.col(2).dot(ray);
    if (!(depth > 0.0) || !std::isfinite(depth)) return false;
    in_plane.emplace_back((pose.rotation.transpose() * (depth * ray - pose.translation)).head<2>());
  }
  return in_plane.size() >= 3 && FitPlaneCircle(in_plane, circle);
}

}  // namespace circline

#endif  // CIRCLINE_REFINE_PLANE_CIRCLE_H_
