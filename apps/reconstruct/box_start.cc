// Where the refinement of a box begins.
#include <Eigen/Dense>
#include <cmath>

#include "apps/reconstruct/fit_box.h"
#include "circline/estimators/line.h"
#include "circline/estimators/observations.h"

namespace circline::apps {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr int kTurns = 360;  // Of the first edge about the camera: one in half a degree.

// The normal of the plane through the camera and the edge.
bool PlaneOfEdge(const Camera& camera, const BoxEdge& edge, Eigen::Vector3d* normal) {
  std::vector<CalibratedPoint> points;
  CalibrateInliers(camera, edge.points, {}, &points);
  LineFit fit;
  if (points.size() < 2 || !FitLine(points, 1.0, &fit).ok()) return false;
  *normal = fit.line;
  return true;
}

double LengthPx(const BoxEdge& edge) { return (edge.points.back() - edge.points.front()).norm(); }

// By how much the third edge misses the third axis, where the first axis is turned in the first
// edge's plane by the angle.
double Miss(const std::array<Eigen::Vector3d, 3>& normals, double angle, Eigen::Matrix3d* axes) {
  const Eigen::Vector3d u = normals[0].unitOrthogonal(), v = normals[0].cross(u);
  const Eigen::Vector3d x = std::cos(angle) * u + std::sin(angle) * v;
  const Eigen::Vector3d y = normals[1].cross(x).normalized();
  *axes << x, y, x.cross(y);
  return axes->col(2).dot(normals[2]);
}

}  // namespace

std::vector<Eigen::Matrix3d> BoxAxes(const Camera& camera, const std::vector<BoxEdge>& edges) {
  std::array<Eigen::Vector3d, 3> normals;
  std::array<double, 3> longest{};
  for (const BoxEdge& edge : edges) {
    const auto axis = static_cast<std::size_t>(edge.axis);
    Eigen::Vector3d normal;
    if (LengthPx(edge) <= longest[axis] || !PlaneOfEdge(camera, edge, &normal)) continue;
    longest[axis] = LengthPx(edge);
    normals[axis] = normal;
  }
  std::vector<Eigen::Matrix3d> found;
  if (!(longest[0] > 0.0 && longest[1] > 0.0 && longest[2] > 0.0)) return found;
  Eigen::Matrix3d axes, before;
  double last = Miss(normals, 0.0, &before);
  for (int k = 1; k <= kTurns; ++k) {
    const double miss = Miss(normals, kPi * k / kTurns, &axes);
    // The sign also changes where y does: there the miss does not pass through zero.
    if ((miss < 0.0) != (last < 0.0) && axes.col(1).dot(before.col(1)) > 0.0)
      found.push_back(std::abs(miss) < std::abs(last) ? axes : before);
    last = miss;
    before = axes;
  }
  return found;
}

bool PlaceBox(const Camera& camera, const std::vector<BoxEdge>& edges, const Eigen::Matrix3d& axes,
              Eigen::Vector3d* translation, Eigen::Vector3d* length) {
  // Each edge's corner lies in its plane: n . (t + sum of lengths) = 0.
  Eigen::Matrix<double, 6, 6> moments = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const BoxEdge& edge : edges) {
    Eigen::Vector3d normal;
    CalibratedPoint ray;
    if (!PlaneOfEdge(camera, edge, &normal)) continue;
    if (PixelToCalibrated(camera, edge.points.front(), &ray)) middle += ray.Homogeneous();
    Eigen::Matrix<double, 6, 1> row;
    row.head<3>() = normal;
    for (int k = 0; k < 3; ++k) {
      const bool counts = k != edge.axis && edge.far[static_cast<std::size_t>(k)];
      row[3 + k] = counts ? normal.dot(axes.col(k)) : 0.0;
    }
    moments += row * row.transpose() * LengthPx(edge);
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

Eigen::Vector3d BoxCorner(const Eigen::Vector3d& length, int corner) {
  return {(corner & 1) != 0 ? length.x() : 0.0, (corner & 2) != 0 ? length.y() : 0.0,
          (corner & 4) != 0 ? length.z() : 0.0};
}

}  // namespace circline::apps
