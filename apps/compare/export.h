// The poses in the formats of other programs.
#ifndef CIRCLINE_APPS_COMPARE_EXPORT_H_
#define CIRCLINE_APPS_COMPARE_EXPORT_H_

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apps/compare/record.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// A camera in the world frame of its photo: X_cam = rotation X_world + translation.
struct ExportedPose {
  std::string name;  // Of the photo.
  std::size_t index = 0;
  Camera camera;  // Of the refined focal length, where that was refined.
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
  std::optional<double> time_s = std::nullopt;  // Where it is known otherwise than by the name.
};

class Exporter {
 public:
  virtual ~Exporter() = default;
  virtual void Add(const ExportedPose& pose) = 0;
  virtual Status Finish() = 0;  // Writes the files.
  // What the files could not take, a sentence; or empty.
  virtual std::string Note() const { return ""; }
};

// images.txt (without points), cameras.txt and an empty points3D.txt. Photos with a space in their
// name are left out: this format ends a name there.
std::unique_ptr<Exporter> MakeColmapExporter(const std::string& folder);
// cameras.gltf: a glTF 2.0 scene with a camera for each photo, upright in programs whose Z is up.
// It has no place for lens distortion and the principal point.
std::unique_ptr<Exporter> MakeGltfExporter(const std::string& folder);
// trajectory.txt: lines "time tx ty tz qx qy qz qw", world from camera. The time is
// time_s, else the photo's name where that is a number, else its position in the set.
std::unique_ptr<Exporter> MakeTumExporter(const std::string& folder);

// Writes the answer to show of every photo that has one; `formats` are colmap, gltf, tum. `notes`:
// sentences, a line each, on what a reader of the files could not know.
Status WriteExports(const std::string& folder, const std::vector<std::string>& formats,
                    std::string* notes);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_EXPORT_H_
