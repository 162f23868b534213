#include "apps/reconstruct/box_start.h"

#include <Eigen/Dense>
#include <cmath>

#include "apps/reconstruct/box_geometry.h"
#include "circline/estimators/line.h"
#include "circline/estimators/observations.h"

namespace circline::apps {

bool PlaneOfPoints(const Camera& camera, const std::vector<Eigen::Vector2d>& pixels,
                   Eigen::Vector3d* normal) {
  std::vector<CalibratedPoint> points;
  CalibrateInliers(camera, pixels, {}, &points);
  LineFit fit;
  if (points.size() < 2 || !FitLine(points, 1.0, &fit).ok()) return false;
  *normal = fit.line;
  return true;
}

// The first axis is X = c u + s v, u and v in its plane, c^2 + s^2 = 1; the second lies across it
// in its own plane: Y ~ n1 x X; the third, X x Y, lies in its own where n1.n2 = (X.n1)(X.n2):
// A c^2 + B c s + C s^2 = 0.
std::vector<Eigen::Matrix3d> OrthogonalAxes(const std::array<Eigen::Vector3d, 3>& normals) {
  const Eigen::Vector3d u = normals[0].unitOrthogonal(), v = normals[0].cross(u).normalized();
  const Eigen::Vector2d by_1(u.dot(normals[1]), v.dot(normals[1])),
      by_2(u.dot(normals[2]), v.dot(normals[2]));
  const double between = normals[1].dot(normals[2]);
  const double A = by_1.x() * by_2.x() - between, C = by_1.y() * by_2.y() - between,
               B = by_1.x() * by_2.y() + by_1.y() * by_2.x();
  const double discriminant = B * B - 4.0 * A * C;
  std::vector<Eigen::Matrix3d> found;
  if (!(discriminant >= 0.0)) return found;
  const double q = -0.5 * (B + std::copysign(std::sqrt(discriminant), B));
  for (const Eigen::Vector2d& root : {Eigen::Vector2d(q, A), Eigen::Vector2d(C, q)}) {
    constexpr double kNone = 1e-9;  // Any x does, or any y.
    if (!(root.norm() > kNone)) continue;
    const Eigen::Vector3d x = (root.x() * u + root.y() * v).normalized(), y = normals[1].cross(x);
    if (!(y.norm() > kNone)) continue;
    Eigen::Matrix3d axes;
    axes << x, y.normalized(), x.cross(y.normalized());
    found.push_back(axes);
  }
  return found;
}

std::vector<Eigen::Matrix3d> BoxAxes(const Camera& camera, const std::vector<BoxEdge>& edges) {
  std::array<Eigen::Vector3d, 3> normals;
  std::array<double, 3> longest{};
  for (const BoxEdge& edge : edges) {
    const auto axis = static_cast<std::size_t>(edge.axis);
    Eigen::Vector3d normal;
    const double length_px = EdgeLengthPx(edge);
    if (length_px <= longest[axis] || !PlaneOfPoints(camera, edge.points, &normal)) continue;
    longest[axis] = length_px;
    normals[axis] = normal;
  }
  if (!(longest[0] > 0.0 && longest[1] > 0.0 && longest[2] > 0.0)) return {};
  return OrthogonalAxes(normals);
}

bool PlaceBox(const Camera& camera, const std::vector<BoxEdge>& edges, const Eigen::Matrix3d& axes,
              Eigen::Vector3d* translation, Eigen::Vector3d* length) {
  // Each edge's corner lies in its plane: n . (t + sum of lengths) = 0.
  Eigen::Matrix<double, 6, 6> moments = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const BoxEdge& edge : edges) {
    Eigen::Vector3d normal;
    CalibratedPoint ray;
    if (!PlaneOfPoints(camera, edge.points, &normal)) continue;
    if (PixelToCalibrated(camera, edge.points.front(), &ray)) middle += ray.Homogeneous();
    Eigen::Matrix<double, 6, 1> row;
    row.head<3>() = normal;
    for (int k = 0; k < 3; ++k) {
      const bool counts = k != edge.axis && edge.far[static_cast<std::size_t>(k)];
      row[3 + k] = counts ? normal.dot(axes.col(k)) : 0.0;
    }
    moments += row * row.transpose() * EdgeLengthPx(edge);
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>> eigen(moments);
  constexpr double kNoInformation = 1e-12;
  if (!(eigen.eigenvalues()[1] > kNoInformation * eigen.eigenvalues()[5])) return false;
  Eigen::Matrix<double, 6, 1> x = eigen.eigenvectors().col(0);
  const double scale = x.head<3>().norm();
  if (!(scale > 0.0)) return false;
  x *= (x.head<3>().dot(middle) > 0.0 ? 1.0 : -1.0) / scale;
  *translation = x.head<3>();
  *length = x.tail<3>();
  return x.allFinite();
}

}  // namespace circline::apps
