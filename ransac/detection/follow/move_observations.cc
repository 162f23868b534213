#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/conic.h"
#include "circline/estimators/directions.h"
#include "circline/ransac/detection/follow/follow_observations.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// Maps the calibrated photo of one pose to that of another, for points of a plane n . X = d.
Matrix3d PlaneHomography(const CameraPose& from, const CameraPose& to, const Vector3d& normal,
                         double distance) {
  const Matrix3d rotation = to.rotation * from.rotation.transpose();
  const Vector3d translation = to.translation - rotation * from.translation;
  const double far = std::copysign(std::max(std::abs(distance), 1e-9), distance);
  return rotation + translation * normal.transpose() / far;
}

// False, and nothing moved, where the camera cannot follow.
bool MovePoint(const Camera& camera, const Matrix3d& homography, Vector2d* pixel) {
  CalibratedPoint p;
  return PixelToCalibrated(camera, *pixel, &p) &&
         CameraToPixel(camera, homography * p.Homogeneous(), pixel);
}

void MoveCircle(const Camera& camera, const Matrix3d& homography, CircleObservation* circle) {
  constexpr std::size_t kKept = 16;  // Points: what tells the bright side.
  std::vector<Vector2d> points, normals;
  const std::size_t n = circle->points.size(), step = 1 + n / kKept;
  for (std::size_t k = 0; k < n && circle->normals.size() == n; k += step) {
    points.push_back(circle->points[k]);
    normals.push_back(circle->normals[k]);
    MovePoint(camera, homography, &points.back());
  }
  circle->points = std::move(points);
  circle->normals = std::move(normals);
  circle->inliers.clear();
  const Matrix3d back = homography.inverse();
  Matrix3d conic;
  if (circle->fit && NormalizeEllipse(back.transpose() * circle->fit->conic * back, &conic))
    circle->fit->conic = conic;
}

// `turn`: of directions, as the camera sees them.
void MovePencil(const Camera& camera, const Matrix3d& homography, const Matrix3d& turn,
                PencilObservation* pencil) {
  // Points of lines of edges that are kept: lenses bend lines. Those of fewer points may be centres
  // of circles (circle_grid.h), and each counts.
  constexpr std::size_t kKept = 6, kFew = 12;
  for (LineObservation& line : pencil->lines) {
    const std::size_t n = line.points.size(), m = n <= kFew ? n : kKept;
    for (std::size_t k = 0; k < m; ++k) {
      line.points[k] = line.points[m > 1 ? k * (n - 1) / (m - 1) : 0];
      MovePoint(camera, homography, &line.points[k]);
    }
    line.points.resize(m);
    line.inliers.clear();
  }
  pencil->readings.clear();
  if (!pencil->fit) return;
  pencil->fit->direction = (turn * pencil->fit->direction).normalized();
  pencil->fit->covariance = turn * pencil->fit->covariance * turn.transpose();
}

// Where lines run that were followed, whose pencil nobody has fitted in this frame: as all frames
// before say.
std::optional<VanishingPointFit> KnownDirection(const PoseHypothesis& last, const std::string& id,
                                                const Matrix3d& to_given) {
  const auto known = std::find_if(last.pencils.begin(), last.pencils.end(),
                                  [&](const PencilEstimate& p) { return p.id == id; });
  if (known == last.pencils.end()) return std::nullopt;
  const Vector3d v = (to_given * known->direction).normalized();
  const double sigma = known->sigma_deg * kDegree;
  return VanishingPointFit{v, sigma * sigma * (Matrix3d::Identity() - v * v.transpose())};
}

}  // namespace

Observations MoveObservations(const Observations& observations, const PoseHypothesis& last,
                              const CameraPose& next) {
  Observations moved = observations;
  const CameraPose& from = last.cam_from_world;
  // Poses are those of the camera that was found, pixels are calibrated by the one given.
  const Matrix3d to_given =
      ChangeOfCamera(CameraOf(last, observations.camera), observations.camera);
  const Matrix3d to_own = to_given.inverse();
  const auto of_plane = [&](const Vector3d& normal, double distance) -> Matrix3d {
    return to_given * PlaneHomography(from, next, normal, distance) * to_own;
  };
  const Vector3d normal = from.rotation.col(2);
  const Matrix3d on_plane = of_plane(normal, normal.dot(from.translation));
  const Matrix3d at_origin = of_plane(Vector3d::UnitZ(), from.translation.z());
  for (CircleObservation& circle : moved.circles) {
    const auto known =
        std::find_if(last.circles.begin(), last.circles.end(),
                     [&](const CircleEstimate& estimate) { return estimate.id == circle.id; });
    const Matrix3d homography = known == last.circles.end()
                                    ? on_plane
                                    : of_plane(known->normal, known->normal.dot(known->center));
    MoveCircle(moved.camera, homography, &circle);
  }
  const Matrix3d turn = to_given * next.rotation * from.rotation.transpose() * to_own;
  for (PencilObservation& pencil : moved.pencils) {
    if (!pencil.fit) pencil.fit = KnownDirection(last, pencil.id, to_given);
    const bool is_on_plane = pencil.plane == moved.frame.plane && !pencil.plane.empty();
    MovePencil(moved.camera, is_on_plane ? on_plane : at_origin, turn, &pencil);
  }
  return moved;
}

}  // namespace circline
