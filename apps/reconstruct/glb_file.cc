#include <tiny_gltf.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstring>
#include <sstream>
#include <utility>
#include <vector>

#include "apps/common/output_file.h"
#include "apps/compare/export.h"
#include "apps/reconstruct/model.h"

namespace circline::apps {
namespace {

constexpr double kFar = 100.0;  // What the camera still sees, in distances to the origin.
constexpr const char* kUnlit = "KHR_materials_unlit";

class GlbBuilder {
 public:
  GlbBuilder() {
    gltf_.asset.version = "2.0";
    gltf_.asset.generator = "circline_reconstruct";
    gltf_.extensionsUsed = {kUnlit};
    gltf_.buffers.resize(1);
    tinygltf::Sampler sampler;
    sampler.minFilter = TINYGLTF_TEXTURE_FILTER_LINEAR_MIPMAP_LINEAR;
    sampler.magFilter = TINYGLTF_TEXTURE_FILTER_LINEAR;
    sampler.wrapS = sampler.wrapT = TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE;
    gltf_.samplers.push_back(sampler);
    tinygltf::Node world;
    world.name = "world";
    const auto upright = GltfUpright();
    world.rotation.assign(upright.begin(), upright.end());
    gltf_.nodes.push_back(std::move(world));
    tinygltf::Scene scene;
    scene.nodes = {0};
    gltf_.scenes.push_back(std::move(scene));
    gltf_.defaultScene = 0;
  }

  void AddPatch(const Patch& patch) {
    const Mesh mesh = MeshOf(patch);
    tinygltf::Primitive primitive;
    primitive.mode = TINYGLTF_MODE_TRIANGLES;
    primitive.material = AddMaterial(patch);
    primitive.attributes["POSITION"] = AddPoints(mesh);
    primitive.attributes["TEXCOORD_0"] = AddTexturePoints(mesh);
    primitive.indices = AddTriangles(mesh);
    tinygltf::Mesh out;
    out.name = patch.name;
    out.primitives.push_back(std::move(primitive));
    gltf_.meshes.push_back(std::move(out));
    tinygltf::Node node;
    node.name = patch.name;
    node.mesh = static_cast<int>(gltf_.meshes.size()) - 1;
    AddChild(std::move(node));
  }

  void AddCamera(const Camera& camera, const CameraPose& pose) {
    const GltfPerspective perspective = GltfPerspectiveOf(camera);
    tinygltf::Camera out;
    out.type = "perspective";
    out.name = "camera";
    out.perspective.yfov = perspective.yfov;
    out.perspective.aspectRatio = perspective.aspect_ratio;
    out.perspective.znear = kGltfNear;
    out.perspective.zfar = kFar * pose.translation.norm();  // The writer has no camera without.
    gltf_.cameras.push_back(std::move(out));
    const GltfNode placed = GltfCameraNode(pose);
    tinygltf::Node node;
    node.name = "camera";
    node.camera = 0;
    node.translation.assign(placed.translation.begin(), placed.translation.end());
    node.rotation.assign(placed.rotation.begin(), placed.rotation.end());
    AddChild(std::move(node));
  }

  bool Write(std::string* bytes) {
    std::ostringstream stream;
    tinygltf::TinyGLTF writer;
    if (!writer.WriteGltfSceneToStream(&gltf_, stream, false, true)) return false;
    *bytes = stream.str();
    return true;
  }

 private:
  void AddChild(tinygltf::Node node) {
    gltf_.nodes.push_back(std::move(node));
    gltf_.nodes.front().children.push_back(static_cast<int>(gltf_.nodes.size()) - 1);
  }

  // Views begin at multiples of four bytes.
  int AddView(const void* data, std::size_t size, int target) {
    std::vector<unsigned char>& buffer = gltf_.buffers.front().data;
    buffer.resize((buffer.size() + 3) / 4 * 4);
    tinygltf::BufferView view;
    view.buffer = 0;
    view.byteOffset = buffer.size();
    view.byteLength = size;
    view.target = target;
    const auto* bytes = static_cast<const unsigned char*>(data);
    buffer.insert(buffer.end(), bytes, bytes + size);
    gltf_.bufferViews.push_back(std::move(view));
    return static_cast<int>(gltf_.bufferViews.size()) - 1;
  }

  template <typename T>
  int AddAccessor(const std::vector<T>& values, int target, int component, int type,
                  std::size_t count, tinygltf::Accessor accessor = {}) {
    accessor.bufferView = AddView(values.data(), values.size() * sizeof(T), target);
    accessor.componentType = component;
    accessor.type = type;
    accessor.count = count;
    gltf_.accessors.push_back(std::move(accessor));
    return static_cast<int>(gltf_.accessors.size()) - 1;
  }

  int AddPoints(const Mesh& mesh) {
    std::vector<float> values;
    Eigen::AlignedBox3f extent;
    for (const Eigen::Vector3d& point : mesh.points) {
      const Eigen::Vector3f p = point.cast<float>();
      extent.extend(p);
      values.insert(values.end(), p.data(), p.data() + 3);
    }
    tinygltf::Accessor accessor;
    accessor.minValues = {extent.min().x(), extent.min().y(), extent.min().z()};
    accessor.maxValues = {extent.max().x(), extent.max().y(), extent.max().z()};
    return AddAccessor(values, TINYGLTF_TARGET_ARRAY_BUFFER, TINYGLTF_COMPONENT_TYPE_FLOAT,
                       TINYGLTF_TYPE_VEC3, mesh.points.size(), std::move(accessor));
  }

  // glTF's run down from the upper left corner.
  int AddTexturePoints(const Mesh& mesh) {
    std::vector<float> values;
    for (const Eigen::Vector2d& st : mesh.texture) {
      values.push_back(static_cast<float>(st.x()));
      values.push_back(static_cast<float>(1.0 - st.y()));
    }
    return AddAccessor(values, TINYGLTF_TARGET_ARRAY_BUFFER, TINYGLTF_COMPONENT_TYPE_FLOAT,
                       TINYGLTF_TYPE_VEC2, mesh.texture.size());
  }

  int AddTriangles(const Mesh& mesh) {
    std::vector<std::uint16_t> values;
    for (const auto& triangle : Triangles(mesh)) {
      for (const unsigned corner : triangle) values.push_back(static_cast<std::uint16_t>(corner));
    }
    return AddAccessor(values, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER,
                       TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT, TINYGLTF_TYPE_SCALAR, values.size());
  }

  int AddMaterial(const Patch& patch) {
    tinygltf::Image image;
    image.name = patch.name;
    image.mimeType = "image/png";
    image.bufferView = AddView(patch.png.data(), patch.png.size(), 0);
    gltf_.images.push_back(std::move(image));
    tinygltf::Texture texture;
    texture.sampler = 0;
    texture.source = static_cast<int>(gltf_.images.size()) - 1;
    gltf_.textures.push_back(std::move(texture));
    tinygltf::Material material;
    material.name = patch.name;
    material.alphaMode = "MASK";
    material.alphaCutoff = 0.5;
    material.pbrMetallicRoughness.baseColorTexture.index =
        static_cast<int>(gltf_.textures.size()) - 1;
    material.pbrMetallicRoughness.metallicFactor = 0.0;
    material.extensions[kUnlit] = tinygltf::Value(tinygltf::Value::Object());
    gltf_.materials.push_back(std::move(material));
    return static_cast<int>(gltf_.materials.size()) - 1;
  }

  tinygltf::Model gltf_;
};

}  // namespace

Status WriteGlb(const Model& model, const Camera& camera, const CameraPose& pose,
                const std::string& path) {
  GlbBuilder builder;
  for (const Patch& patch : model.patches) builder.AddPatch(patch);
  builder.AddCamera(camera, pose);
  std::string bytes;
  if (!builder.Write(&bytes)) return Status::Failed("cannot write " + path);
  return WriteFile(path, bytes);
}

}  // namespace circline::apps
