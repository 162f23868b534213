// A textured piece of a model's surface.
#ifndef CIRCLINE_APPS_RECONSTRUCT_PATCH_H_
#define CIRCLINE_APPS_RECONSTRUCT_PATCH_H_

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/pose.h"

namespace circline::apps {

enum class PatchShape {
  kParallelogram,  // corner + s u + t v.
  kDisc,           // That of it which touches all sides.
  kMantle,         // Of a cylinder: corner + cos(s angle) u + sin(s angle) w + t v.
};

// s and t run from 0 to 1, in the texture s to the right and t upwards.
struct Patch {
  std::string name;  // Unlike those of others; after NamePatches of files and materials, too.
  PatchShape shape = PatchShape::kParallelogram;
  Eigen::Vector3d corner, u, v;
  Eigen::Vector3d w = Eigen::Vector3d::Zero();  // Of a mantle: as long as u, at right angles to it.
  double angle = 0.0;                           // Of a mantle, radians.
  cv::Mat texture;  // BGRA; transparent where the photo does not show it.
  std::string png;  // The same as the bytes of a file.

  Eigen::Vector3d At(double s, double t) const;
};

struct Mesh {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector2d> texture;      // (s, t) of each point.
  std::vector<std::vector<unsigned>> faces;  // Convex polygons, counterclockwise from outside.
};
// The outside is where u and v turn counterclockwise; of a mantle, away from its axis.
Mesh MeshOf(const Patch& patch);

// The faces of a mesh cut into triangles.
std::vector<std::array<unsigned, 3>> Triangles(const Mesh& mesh);

// Whether the ray from `eye` to `point` meets the patch before it reaches the point.
bool Hides(const Patch& patch, const Eigen::Vector3d& eye, const Eigen::Vector3d& point);

// The photo as seen on the patch, as finely as the photo shows it where that is finest (or with
// `longest_px` pixels along its longer side, if that is not 0), without what lies outside the
// photo, behind one of `others`, or is seen from behind.
cv::Mat PatchTexture(const cv::Mat& photo, const Camera& camera, const CameraPose& pose,
                     const Patch& patch, const std::vector<Patch>& others, int longest_px);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_PATCH_H_
