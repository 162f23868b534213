#include <nlohmann/json.hpp>

#include "apps/common/output_file.h"
#include "apps/compare/export.h"
#include "apps/compare/gltf_pose.h"

namespace circline::apps {
namespace {

using Json = nlohmann::ordered_json;

Json CameraJson(const Camera& camera) {
  const GltfPerspective perspective = GltfPerspectiveOf(camera);
  return {{"type", "perspective"},
          {"name", camera.id},
          {"perspective",
           {{"yfov", perspective.yfov},
            {"aspectRatio", perspective.aspect_ratio},
            {"znear", kGltfNear}}}};
}

class GltfExporter : public Exporter {
 public:
  explicit GltfExporter(std::string folder) : folder_(std::move(folder)) {}

  void Add(const ExportedPose& pose) override {
    const Json camera = CameraJson(pose.camera);
    std::size_t id = 0;
    while (id < cameras_.size() && cameras_[id] != camera) ++id;
    if (id == cameras_.size()) cameras_.push_back(camera);
    const GltfNode node = GltfCameraNode({pose.rotation, pose.translation});
    nodes_.push_back({{"name", pose.name},
                      {"camera", id},
                      {"translation", node.translation},
                      {"rotation", node.rotation}});
  }

  Status Finish() override {
    Json children = Json::array();
    for (std::size_t i = 0; i < nodes_.size(); ++i) children.push_back(i + 1);
    Json root = {{"name", "world"}, {"rotation", GltfUpright()}};
    if (!nodes_.empty()) root["children"] = children;
    Json nodes = Json::array({root});
    nodes.insert(nodes.end(), nodes_.begin(), nodes_.end());
    Json gltf;
    gltf["asset"] = {{"version", "2.0"}, {"generator", "circline_compare"}};
    gltf["scene"] = 0;
    gltf["scenes"] = Json::array({{{"nodes", {0}}}});
    gltf["nodes"] = nodes;
    if (!cameras_.empty()) gltf["cameras"] = cameras_;
    return WriteFile(folder_ + "/cameras.gltf",
                     gltf.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
  }

 private:
  std::string folder_;
  std::vector<Json> cameras_;
  Json nodes_ = Json::array();
};

}  // namespace

std::unique_ptr<Exporter> MakeGltfExporter(const std::string& folder) {
  return std::make_unique<GltfExporter>(folder);
}

}  // namespace circline::apps
