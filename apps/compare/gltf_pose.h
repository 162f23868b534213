// Poses and cameras in glTF's terms.
#ifndef CIRCLINE_APPS_COMPARE_GLTF_POSE_H_
#define CIRCLINE_APPS_COMPARE_GLTF_POSE_H_

#include <Eigen/Core>
#include <array>

#include "circline/estimators/camera.h"
#include "circline/estimators/pose.h"

namespace circline::apps {

// Turns our Z, the plane's normal, into glTF's Y, which is up: the quaternion (x, y, z, w) of the
// node above all others.
std::array<double, 4> GltfUpright();

// A camera's node. glTF cameras look along -Z with Y up, ours along +Z with Y down.
struct GltfNode {
  std::array<double, 3> translation;
  std::array<double, 4> rotation;  // x, y, z, w.
};
GltfNode GltfCameraNode(const CameraPose& pose);

// A pinhole camera with its axis in the middle: lens and principal point have no place in glTF.
struct GltfPerspective {
  double yfov, aspect_ratio;
};
GltfPerspective GltfPerspectiveOf(const Camera& camera);

constexpr double kGltfNear = 1e-3;

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_GLTF_POSE_H_
