#include <iomanip>
#include <sstream>
#include <string>
#include <vector>

#include "apps/common/output_file.h"
#include "apps/reconstruct/model.h"

namespace circline::apps {
namespace {

std::string TextureName(const Patch& patch) {
  return patch.name == "plane" ? "texture.png" : "texture_" + patch.name + ".png";
}

class ObjText {
 public:
  ObjText() { text_ << std::setprecision(17) << "mtllib model.mtl\n"; }

  void AddPatch(const Patch& patch) {
    text_ << "o " << patch.name << "\n";
    const std::size_t before = vertices_ + 1, before_texture = texture_vertices_ + 1;
    const Mesh mesh = MeshOf(patch);
    for (const Eigen::Vector3d& point : mesh.points) AddVertex(point);
    for (const Eigen::Vector2d& st : mesh.texture)
      text_ << "vt " << st.x() << " " << st.y() << "\n";
    text_ << "usemtl " << patch.name << "\n";
    for (const std::vector<unsigned>& face : mesh.faces) {
      text_ << "f";
      for (const unsigned corner : face)
        text_ << " " << before + corner << "/" << before_texture + corner;
      text_ << "\n";
    }
    texture_vertices_ += mesh.texture.size();
  }

  // Its base at this depth is what the photo shows there.
  void AddCamera(const Camera& camera, const CameraPose& pose, double depth) {
    text_ << "o camera\n";
    const std::size_t apex = vertices_ + 1;
    const auto world = [&pose](const Eigen::Vector3d& x) {
      return (pose.rotation.transpose() * (x - pose.translation)).eval();
    };
    AddVertex(world(Eigen::Vector3d::Zero()));
    const double w = camera.width, h = camera.height;
    for (const Eigen::Vector2d& corner : {Eigen::Vector2d(0, 0), Eigen::Vector2d(w, 0),
                                          Eigen::Vector2d(w, h), Eigen::Vector2d(0, h)}) {
      AddVertex(world(depth * Eigen::Vector3d((corner.x() - 0.5 - camera.cx) / camera.fx,
                                              (corner.y() - 0.5 - camera.cy) / camera.fy, 1.0)));
    }
    for (std::size_t i = 1; i <= 4; ++i) {
      text_ << "l " << apex << " " << apex + i << "\nl " << apex + i << " " << apex + i % 4 + 1
            << "\n";
    }
  }
  std::string text() const { return text_.str(); }

 private:
  void AddVertex(const Eigen::Vector3d& x) {
    text_ << "v " << x.x() << " " << x.y() << " " << x.z() << "\n";
    ++vertices_;
  }
  std::ostringstream text_;
  std::size_t vertices_ = 0, texture_vertices_ = 0;  // Written; OBJ counts from 1.
};

}  // namespace

Status WriteObj(const Model& model, const Camera& camera, const CameraPose& pose,
                const std::string& folder) {
  ObjText obj;
  std::ostringstream materials;
  Status status;
  for (const Patch& patch : model.patches) {
    obj.AddPatch(patch);
    materials << "newmtl " << patch.name << "\nKa 1 1 1\nKd 1 1 1\nKs 0 0 0\nillum 1\nmap_Kd "
              << TextureName(patch) << "\n";
    if (status.ok()) status = WriteFile(folder + "/" + TextureName(patch), patch.png);
  }
  obj.AddCamera(camera, pose, 0.15 * pose.translation.norm());
  if (status.ok()) status = WriteFile(folder + "/model.mtl", materials.str());
  return status.ok() ? WriteFile(folder + "/model.obj", obj.text()) : status;
}

}  // namespace circline::apps
