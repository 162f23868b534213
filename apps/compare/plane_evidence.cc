#include "apps/compare/plane_evidence.h"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "apps/compare/pixel_ellipse.h"
#include "circline/estimators/metrology.h"

namespace circline::apps {
namespace {

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

bool PixelOnPlane(const Camera& camera, const CameraPose& pose, const Eigen::Vector2d& pixel,
                  Eigen::Vector2d* point) {
  CalibratedPoint ray;
  return PixelToCalibrated(camera, pixel, &ray) && PointOnPlane(pose, ray.Homogeneous(), point);
}

Eigen::AlignedBox2d EvidenceOnPlane(const Observations& observations, const Camera& camera,
                                    const CameraPose& pose) {
  constexpr double kDepthRange = 4.0;
  std::vector<std::pair<double, Eigen::Vector2d>> points;  // Depth in the camera, and the point.
  double nearest = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector2d& pixel : PixelsOfPlane(observations)) {
    Eigen::Vector2d point;
    if (!PixelOnPlane(camera, pose, pixel, &point)) continue;
    const double depth = pose.rotation.row(2).head<2>().dot(point) + pose.translation.z();
    points.emplace_back(depth, point);
    nearest = std::min(nearest, depth);
  }
  Eigen::AlignedBox2d box;
  for (const auto& [depth, point] : points) {
    if (depth <= kDepthRange * nearest) box.extend(point);
  }
  return box;
}

}  // namespace circline::apps
