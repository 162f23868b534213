#include <Eigen/Geometry>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/common/output_file.h"
#include "apps/compare/export.h"

namespace circline::apps {
namespace {

using Json = nlohmann::ordered_json;

// glTF cameras look along -Z with Y up, ours along +Z with Y down.
const Eigen::DiagonalMatrix<double, 3>& OurFromGltf() {
  static const Eigen::DiagonalMatrix<double, 3> turn(1.0, -1.0, -1.0);
  return turn;
}

Json CameraJson(const Camera& camera) {
  const double half_x = 0.5 * camera.width / camera.fx, half_y = 0.5 * camera.height / camera.fy;
  return {{"type", "perspective"},
          {"name", camera.id},
          {"perspective",
           {{"yfov", 2.0 * std::atan(half_y)}, {"aspectRatio", half_x / half_y}, {"znear", 1e-3}}}};
}

class GltfExporter : public Exporter {
 public:
  explicit GltfExporter(std::string folder) : folder_(std::move(folder)) {}

  void Add(const ExportedPose& pose) override {
    const Json camera = CameraJson(pose.camera);
    std::size_t id = 0;
    while (id < cameras_.size() && cameras_[id] != camera) ++id;
    if (id == cameras_.size()) cameras_.push_back(camera);
    const Eigen::Vector3d center = -(pose.rotation.transpose() * pose.translation);
    const Eigen::Matrix3d world_from_gltf = pose.rotation.transpose() * OurFromGltf();
    const Eigen::Quaterniond q(world_from_gltf);
    nodes_.push_back({{"name", pose.name},
                      {"camera", id},
                      {"translation", {center.x(), center.y(), center.z()}},
                      {"rotation", {q.x(), q.y(), q.z(), q.w()}}});
  }

  // The first node turns our Z, the plane's normal, into glTF's Y, which is up.
  Status Finish() override {
    Json children = Json::array();
    for (std::size_t i = 0; i < nodes_.size(); ++i) children.push_back(i + 1);
    const double half = std::sqrt(0.5);
    Json root = {{"name", "world"}, {"rotation", {-half, 0.0, 0.0, half}}};
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
