#include "apps/compare/gltf_pose.h"

#include <Eigen/Geometry>
#include <cmath>

namespace circline::apps {

std::array<double, 4> GltfUpright() {
  const double half = std::sqrt(0.5);
  return {-half, 0.0, 0.0, half};
}

GltfNode GltfCameraNode(const CameraPose& pose) {
  const Eigen::Vector3d center = -(pose.rotation.transpose() * pose.translation);
  const Eigen::Matrix3d world_from_gltf =
      pose.rotation.transpose() * Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  const Eigen::Quaterniond q(world_from_gltf);
  return {{center.x(), center.y(), center.z()}, {q.x(), q.y(), q.z(), q.w()}};
}

GltfPerspective GltfPerspectiveOf(const Camera& camera) {
  const double half_x = 0.5 * camera.width / camera.fx, half_y = 0.5 * camera.height / camera.fy;
  return {2.0 * std::atan(half_y), half_x / half_y};
}

}  // namespace circline::apps
