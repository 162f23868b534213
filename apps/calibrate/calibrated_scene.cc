#include "apps/calibrate/calibrated_scene.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "apps/common/camera_file.h"
#include "apps/common/document.h"
#include "apps/common/output_file.h"
#include "apps/common/storage_node.h"

namespace circline::apps {
namespace {

nlohmann::ordered_json Entry(const AdjustedCamera& made) {
  StatedCameraSigma sigma;  // One that is held has no deviation, and nothing is said of it.
  const double point = std::max(made.Sigma(2), made.Sigma(3));
  if (made.Sigma(0) > 0.0) sigma.log_focal = made.Sigma(0);
  if (point > 0.0) sigma.principal_point_px = point;
  if (made.Sigma(4) > 0.0) sigma.k1 = made.Sigma(4);
  return CameraEntry(made.camera, sigma);
}

}  // namespace

Status WriteCalibratedScene(const std::string& source, const AdjustedPhotos& adjusted,
                            const std::vector<SceneImage>& images, const std::string& path) {
  StorageDocument given;
  if (!source.empty()) {
    const Status status = given.Open(source);
    if (!status.ok()) return status;
  }
  nlohmann::ordered_json scene;
  if (given.root()->contains("rigid")) scene["rigid"] = (*given.root())["rigid"];
  std::set<std::string> ids;
  for (const AdjustedCamera& made : adjusted.cameras) {
    scene["cameras"].push_back(Entry(made));
    ids.insert(made.camera.id);
  }
  for (const SceneImage& image : images) {
    const std::string& id = image.observations.camera.id;
    if (ids.count(id) == 0) continue;  // No photo of that camera could be read.
    nlohmann::ordered_json entry;
    if (!source.empty()) entry = (*given.root())["images"][image.index];
    entry["file"] = std::filesystem::absolute(image.path).lexically_normal().string();
    entry["camera"] = id;
    scene["images"].push_back(std::move(entry));
  }
  return WriteFile(path, DocumentText(scene));
}

}  // namespace circline::apps
