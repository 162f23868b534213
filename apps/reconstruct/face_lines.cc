#include "apps/reconstruct/face_lines.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "apps/reconstruct/box_geometry.h"
#include "circline/ransac/detection/segment_meetings.h"

namespace circline::apps {
namespace {

// Of a line's plane through the camera against an axis along which it is taken to be, radians: what
// a fit's direction may be off. This and the next two are guesses, tried with no other value.
constexpr double kLineAlongRad = 0.04;
// Of the photo's longer side: shorter lines are letters.
constexpr double kLeastLineShare = 0.03;
// Of a face, about its middle: its edges are no lines on it.
constexpr double kWithinFace = 0.98;

// Where the photo has the face across `axis`; none if it is not seen.
std::optional<ConvexRegion> SeenFace(const BoxFit& fit, int axis, bool far) {
  if (!FaceIsSeen(fit.cam_from_box, fit.length, axis, far)) return std::nullopt;
  std::vector<Eigen::Vector2d> corners;
  for (int corner = 0; corner < 8; ++corner) {
    if ((corner >> axis & 1) != (far ? 1 : 0)) continue;
    corners.emplace_back();
    const Eigen::Vector3d at = fit.InCamera(BoxCorner(fit.length, corner));
    if (!CameraToPixel(fit.camera, at, &corners.back())) return std::nullopt;
  }
  return ConvexRegion(corners, kWithinFace);
}

}  // namespace

std::vector<FaceLine> FaceLines(const std::vector<DetectedLine>& lines, const BoxFit& fit) {
  std::vector<FaceLine> found;
  const double least_px = kLeastLineShare * std::max(fit.camera.width, fit.camera.height);
  for (int across = 0; across < 3; ++across) {
    for (const bool far : {false, true}) {
      const std::optional<ConvexRegion> face = SeenFace(fit, across, far);
      if (!face) continue;
      for (const DetectedLine& line : lines) {
        if (line.length_px < least_px || !face->Contains(line.ends)) continue;
        for (int axis = 0; axis < 3; ++axis) {
          const double sine = fit.cam_from_box.rotation.col(axis).dot(line.fit.line.normalized());
          if (axis == across || std::abs(sine) > kLineAlongRad) continue;
          found.push_back({axis, line.points, line.sigma_px});
        }
      }
    }
  }
  return found;
}

}  // namespace circline::apps
