#include "apps/compare/plane_evidence.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "apps/compare/pixel_ellipse.h"

namespace circline::apps {
namespace {

// A pixel's point on the plane Z = 0.
struct PlanePoint {
  Eigen::Vector2d world;
  double depth;  // Camera frame, along the optical axis.
};

// Where the ray of a pixel meets the plane in front of the camera; false if it does not.
bool PixelOnPlane(const Camera& camera, const CameraPose& pose, const Eigen::Vector2d& pixel,
                  PlanePoint* result) {
  CalibratedPoint point;
  if (!PixelToCalibrated(camera, pixel, &point)) return false;
  const Eigen::Vector3d ray = point.Homogeneous();
  const Eigen::Vector3d normal = pose.rotation.col(2);
  const double along = normal.dot(ray);
  if (std::abs(along) < 1e-3 * ray.norm()) return false;  // Next to the vanishing line.
  result->depth = normal.dot(pose.translation) / along;
  result->world = (pose.rotation.transpose() * (result->depth * ray - pose.translation)).head<2>();
  return result->depth > 0.0 && result->world.allFinite();
}

// Pixels of everything that lies on the world's plane.
std::vector<Eigen::Vector2d> PixelsOfPlane(const Observations& observations) {
  const Observations resolved = ResolveWorld(observations);
  const std::string& plane = resolved.frame.plane;
  std::vector<Eigen::Vector2d> pixels;
  for (const CircleObservation& circle : resolved.circles) {
    if (circle.plane != plane) continue;
    pixels.insert(pixels.end(), circle.points.begin(), circle.points.end());
  }
  for (const PencilObservation& pencil : resolved.pencils) {
    if (pencil.direction == PencilDirection::kZ || pencil.plane != plane) continue;
    for (const LineObservation& line : pencil.lines) {
      const Segment ends = EndPoints(line);
      pixels.insert(pixels.end(), ends.begin(), ends.end());
    }
  }
  return pixels;
}

}  // namespace

Eigen::AlignedBox2d EvidenceOnPlane(const Observations& observations, const Camera& camera,
                                    const CameraPose& pose) {
  constexpr double kDepthRange = 4.0;
  std::vector<PlanePoint> points;
  double nearest = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector2d& pixel : PixelsOfPlane(observations)) {
    PlanePoint point;
    if (!PixelOnPlane(camera, pose, pixel, &point)) continue;
    points.push_back(point);
    nearest = std::min(nearest, point.depth);
  }
  Eigen::AlignedBox2d box;
  for (const PlanePoint& point : points) {
    if (point.depth <= kDepthRange * nearest) box.extend(point.world);
  }
  return box;
}

}  // namespace circline::apps
