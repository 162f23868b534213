#include "apps/reconstruct/box_geometry.h"

#include <Eigen/Geometry>

namespace circline::apps {

Eigen::Vector3d BoxCorner(const Eigen::Vector3d& length, int corner) {
  return {(corner & 1) != 0 ? length.x() : 0.0, (corner & 2) != 0 ? length.y() : 0.0,
          (corner & 4) != 0 ? length.z() : 0.0};
}

bool FaceIsSeen(const CameraPose& cam_from_box, const Eigen::Vector3d& length, int axis, bool far) {
  const Eigen::Vector3d eye = -(cam_from_box.rotation.transpose() * cam_from_box.translation);
  return far ? eye[axis] > length[axis] : eye[axis] < 0.0;
}

double EdgeLengthPx(const BoxEdge& edge) {
  Eigen::AlignedBox2d extent;
  for (const Eigen::Vector2d& point : edge.points) extent.extend(point);
  return extent.isEmpty() ? 0.0 : extent.diagonal().norm();
}

}  // namespace circline::apps
