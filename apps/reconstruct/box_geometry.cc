#include "apps/reconstruct/box_geometry.h"

#include <Eigen/Geometry>

namespace circline::apps {

Eigen::Vector3d BoxCorner(const Eigen::Vector3d& length, int corner) {
  return {(corner & 1) != 0 ? length.x() : 0.0, (corner & 2) != 0 ? length.y() : 0.0,
          (corner & 4) != 0 ? length.z() : 0.0};
}

bool FaceIsSeen(const BoxFit& fit, int axis, bool far) {
  const CameraPose& pose = fit.cam_from_box;
  const Eigen::Vector3d eye = -(pose.rotation.transpose() * pose.translation);
  return far ? eye[axis] > fit.length[axis] : eye[axis] < 0.0;
}

int NumSeenFaces(const BoxFit& fit, int axis, int corner) {
  int seen = 0;
  for (int k = 0; k < 3; ++k) {
    if (k != axis && FaceIsSeen(fit, k, (corner >> k & 1) != 0)) ++seen;
  }
  return seen;
}

double EdgeLengthPx(const BoxEdge& edge) {
  Eigen::AlignedBox2d extent;
  for (const Eigen::Vector2d& point : edge.points) extent.extend(point);
  return extent.isEmpty() ? 0.0 : extent.diagonal().norm();
}

}  // namespace circline::apps
