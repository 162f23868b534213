#include "apps/common/noise_file.h"

#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "apps/common/storage_node.h"

namespace circline::apps {
namespace {

// `Value` is a double, or an optional one that stays empty where the file does not name it.
template <typename Value>
void ReadFields(const StorageNode& node, const std::vector<std::pair<std::string, Value*>>& fields,
                const std::vector<std::string>& other_keys) {
  std::vector<std::string> keys = other_keys;
  for (const auto& field : fields) keys.push_back(field.first);
  node.AllowKeys(keys);
  for (const auto& [key, value] : fields) {
    const StorageNode item = node.Get(key);
    if (item.Exists()) *value = item.Number();
  }
}

}  // namespace

Status ReadNoiseModel(const std::string& path, NoiseModel* model, StatedCameraSigma* stated) {
  StorageNode::Json document;
  Status status = ReadStorage(path, &document);
  if (!status.ok()) return status;
  NoiseModel read = *model;
  const StorageNode root(&document, "", &status);
  ReadFields<double>(root,
                     {{"contour_px", &read.contour_px},
                      {"line_px", &read.line_px},
                      {"correlation_px", &read.correlation_px},
                      {"contour_offset_px", &read.contour_offset_px},
                      {"circle_tilt_rad", &read.circle_tilt_rad},
                      {"circle_height", &read.circle_height},
                      {"circle_shape", &read.circle_shape},
                      {"line_direction_rad", &read.line_direction_rad},
                      {"pencil_axis_rad", &read.pencil_axis_rad},
                      {"grid_line", &read.grid_line},
                      {"radius", &read.radius},
                      {"length", &read.length},
                      {"spread", &read.spread}},
                     {"camera"});
  StatedCameraSigma of_camera;
  const StorageNode camera = root.Get("camera");
  if (camera.Exists()) {
    ReadFields<std::optional<double>>(camera,
                                      {{"log_focal", &of_camera.log_focal},
                                       {"log_aspect", &of_camera.log_aspect},
                                       {"principal_point_px", &of_camera.principal_point_px},
                                       {"k1", &of_camera.k1},
                                       {"doubtful_log_focal", &of_camera.doubtful_log_focal}},
                                      {});
  }
  read.camera = of_camera.Over(read.camera);
  if (status.ok()) status = read.Validate();
  if (!status.ok()) return Status::Invalid(path + ": " + status.message);
  *model = read;
  if (stated != nullptr) *stated = of_camera;
  return status;
}

}  // namespace circline::apps
