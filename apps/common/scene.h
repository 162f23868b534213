// Scene files: an image set with what is known of it (docs: scene files). YAML or JSON.
#ifndef CIRCLINE_APPS_COMMON_SCENE_H_
#define CIRCLINE_APPS_COMMON_SCENE_H_

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "apps/common/camera_file.h"
#include "apps/common/solids.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// What the evidence of a photo cannot tell about the true rotation.
enum class Symmetry {
  kNone,
  kD2,    // The axes' senses: sign changes of determinant 1.
  kD4,    // Also which axis is which: a square grid found in the photo.
  kAxis,  // All but the plane's normal, up to sign.
};

// As in scene files.
const char* SymmetryName(Symmetry symmetry);

struct TrueDirection {
  std::string pencil;         // Id.
  Eigen::Vector3d direction;  // Unit, camera frame, without sense.
};

// What is known to be true of one photo.
struct Truth {
  std::optional<Eigen::Matrix3d> rotation;     // cam_from_world of the frame's plane.
  std::optional<Eigen::Vector3d> translation;  // Same.
  Symmetry symmetry = Symmetry::kNone;
  std::vector<TrueDirection> directions;
};

// A circle that is to be detected inside a rectangle of the photo.
struct CircleRoi {
  std::size_t circle;            // Index in Observations::circles, whose points are empty yet.
  std::array<int, 4> rectangle;  // x, y, width, height; pixels.
};

// A point of the world and its image: no evidence for our solvers, which do without, but for those
// that are compared with them.
struct KnownPoint {
  Eigen::Vector2d pixel;  // Of the photo as taken.
  Eigen::Vector3d world;  // In the frame of the truth.
};

struct SceneImage {
  std::string name;                // As the scene file writes it.
  std::string path;                // Where it is.
  std::size_t index = 0;           // In the whole set, also where only a part of it is worked on.
  std::size_t set_size = 0;        // Images in the whole set.
  std::string stem;                // Of file names that belong to it, unique in the whole set.
  Observations observations;       // Camera, and what is annotated; nothing fitted or detected yet.
  StatedCameraSigma camera_sigma;  // Of that camera.
  std::optional<CameraSigma> guessed_sigma;  // The same, where nobody has calibrated it.
  std::string camera_from;         // Where the focal length is from then, and how sure it is.
  bool detect_everything = false;  // No circle and no pencil is annotated.
  std::vector<CircleRoi> rois;
  std::optional<Truth> truth;
  std::vector<KnownPoint> points;
  Solids solids;  // To be modelled; no evidence of the pose.
};

// Whether a circle or a pencil lies in the plane of that id.
bool NamesPlane(const Observations& observations, const std::string& plane);

// Reads and checks a scene file. `cameras`, from a camera file, are for one that has none of its
// own, else empty; an image that names no camera takes the only one there is. Not ok: one line that
// names the file, the place in it (images[3] ("a.jpg").circles[0].contour) and what is wrong there.
// `rigid`, which may be null: auto, yes or no, as the file says it; empty where it does not.
Status ReadScene(const std::string& path, const std::vector<Camera>& cameras,
                 std::vector<SceneImage>* images, std::string* rigid = nullptr);

// The same of a text, which messages call `name`; photos are relative to `folder`.
Status ParseScene(const std::string& name, const std::string& text, const std::string& folder,
                  const std::vector<Camera>& cameras, std::vector<SceneImage>* images,
                  std::string* rigid = nullptr);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_SCENE_H_
