#include "apps/calibrate/calibrated_scene.h"

#include <algorithm>
#include <filesystem>
#include <opencv2/core.hpp>

#include "apps/common/camera_file.h"
#include "apps/common/output_file.h"
#include "apps/common/storage_node.h"

namespace circline::apps {
namespace {

void WriteNumbers(const std::string& key, const std::vector<double>& values, cv::FileStorage* out) {
  out->startWriteStruct(key, cv::FileNode::SEQ | cv::FileNode::FLOW);
  for (const double value : values) out->write("", value);
  out->endWriteStruct();
}

void WriteCamera(const AdjustedCamera& made, cv::FileStorage* out) {
  const Camera& camera = made.camera;
  out->startWriteStruct("", cv::FileNode::MAP);
  *out << "id" << camera.id << "model" << ModelName(camera.model);
  if (camera.width > 0) *out << "width" << camera.width;
  if (camera.height > 0) *out << "height" << camera.height;
  WriteNumbers("camera_matrix",
               {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0}, out);
  if (camera.model != CameraModel::kPinhole) WriteNumbers("distortion", Distortion(camera), out);
  // One that is held has no deviation, and nothing is said of it.
  if (made.Sigma(0) > 0.0) *out << "focal_sigma" << made.Sigma(0);
  const double point = std::max(made.Sigma(2), made.Sigma(3));
  if (point > 0.0) *out << "principal_point_sigma_px" << point;
  if (made.Sigma(4) > 0.0) *out << "k1_sigma" << made.Sigma(4);
  out->endWriteStruct();
}

void Copy(const cv::FileNode& node, const std::string& key, cv::FileStorage* out) {
  if (node.isMap() || node.isSeq()) {
    const bool is_flat = node.isSeq() && node.begin() != node.end() && !(*node.begin()).isMap();
    out->startWriteStruct(key, (node.isMap() ? cv::FileNode::MAP : cv::FileNode::SEQ) |
                                   (is_flat ? cv::FileNode::FLOW : 0));
    for (const cv::FileNode& child : node) Copy(child, node.isMap() ? child.name() : "", out);
    out->endWriteStruct();
  } else if (node.isInt()) {
    out->write(key, static_cast<int>(node));
  } else if (node.isReal()) {
    out->write(key, node.real());
  } else if (node.isString()) {
    out->write(key, node.string());
  }
}

}  // namespace

Status WriteCalibratedScene(const std::string& source, const AdjustedPhotos& adjusted,
                            const std::vector<SceneImage>& images, const std::string& path) {
  StorageDocument document;
  if (!source.empty()) {
    const Status status = document.Open(source);
    if (!status.ok()) return status;
  }
  cv::FileStorage out("x.yml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
  if (!source.empty() && !document.root()["rigid"].empty())
    Copy(document.root()["rigid"], "rigid", &out);
  out.startWriteStruct("cameras", cv::FileNode::SEQ);
  for (const AdjustedCamera& made : adjusted.cameras) WriteCamera(made, &out);
  out.endWriteStruct();
  out.startWriteStruct("images", cv::FileNode::SEQ);
  for (const SceneImage& image : images) {
    const std::string& id = image.observations.camera.id;
    const bool is_known = std::any_of(adjusted.cameras.begin(), adjusted.cameras.end(),
                                      [&](const AdjustedCamera& c) { return c.camera.id == id; });
    if (!is_known) continue;  // No photo of that camera could be read.
    out.startWriteStruct("", cv::FileNode::MAP);
    out << "file" << std::filesystem::absolute(image.path).lexically_normal().string() << "camera"
        << id;
    if (!source.empty()) {
      const cv::FileNode given = document.root()["images"][static_cast<int>(image.index)];
      for (const cv::FileNode& child : given) {
        if (child.name() != "file" && child.name() != "camera") Copy(child, child.name(), &out);
      }
    }
    out.endWriteStruct();
  }
  out.endWriteStruct();
  return WriteFile(path, out.releaseAndGetString());
}

}  // namespace circline::apps
