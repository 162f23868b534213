// The poses in the formats of other programs.
#ifndef CIRCLINE_APPS_COMPARE_EXPORT_H_
#define CIRCLINE_APPS_COMPARE_EXPORT_H_

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// A camera in the world frame of its photo.
struct ExportedPose {
  std::string name;  // Of the photo.
  std::size_t index = 0;
  Camera camera;  // Of the refined focal length, where that was refined.
  CameraPose cam_from_world;
  std::optional<double> time_s = std::nullopt;  // Where it is known otherwise than by the name.
};

// ---- glTF's terms ----

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

// ---- Files ----

struct ExportFormat {
  std::string name;
  std::vector<std::string> files;
};

// colmap: images.txt (without points), cameras.txt and an empty points3D.txt. Photos with a space
// in their name are left out: this format ends a name there. gltf: cameras.gltf, a glTF 2.0 scene
// with a camera for each photo, upright in programs whose Z is up. It has no place for lens
// distortion and the principal point. tum: trajectory.txt, lines "time tx ty tz qx qy qz qw", world
// from camera. The time is time_s, else the photo's name where that is a number, else its position
// in the set.
const std::vector<ExportFormat>& ExportFormats();

// `format`: one of these. `note`: what the files could not take, a sentence; or empty.
Status ExportPoses(const std::string& format, const std::vector<ExportedPose>& poses,
                   const std::string& folder, std::string* note);

// Those of the files in that folder that ExportPoses has written, by what stands in them.
std::vector<std::string> ExportedFilesIn(const std::string& folder);

// Writes the answer to show of every photo that has one. `notes`: sentences, a line each, on what a
// reader of the files could not know.
Status WriteExports(const std::string& folder, const std::vector<std::string>& formats,
                    std::string* notes);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_EXPORT_H_
