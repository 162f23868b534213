#include "apps/reconstruct/obj_file.h"

#include <cmath>
#include <iomanip>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <vector>

#include "apps/common/output_file.h"

namespace circline::apps {
namespace {

constexpr int kDiscCorners = 64;

std::string TextureName(const Patch& patch) {
  return patch.name == "plane" ? "texture.png" : "texture_" + patch.name + ".png";
}

// The outline in (s, t) of the patch, counterclockwise.
std::vector<Eigen::Vector2d> Outline(const Patch& patch) {
  if (!patch.is_disc) return {{0.0, 0.0}, {1.0, 0.0}, {1.0, 1.0}, {0.0, 1.0}};
  std::vector<Eigen::Vector2d> corners;
  for (int i = 0; i < kDiscCorners; ++i) {
    const double angle = 2.0 * 3.14159265358979323846 * i / kDiscCorners;
    corners.emplace_back(0.5 + 0.5 * std::cos(angle), 0.5 + 0.5 * std::sin(angle));
  }
  return corners;
}

class ObjText {
 public:
  ObjText() { text_ << std::setprecision(9) << "mtllib model.mtl\n"; }

  void AddPatch(const Patch& patch) {
    text_ << "o " << patch.name << "\n";
    const std::vector<Eigen::Vector2d> outline = Outline(patch);
    for (const Eigen::Vector2d& c : outline) {
      AddVertex(patch.corner + c.x() * patch.u + c.y() * patch.v);
      text_ << "vt " << c.x() << " " << c.y() << "\n";
    }
    text_ << "usemtl " << patch.name << "\nf";
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const std::size_t vertex = vertices_ - outline.size() + i + 1;
      text_ << " " << vertex << "/" << ++texture_vertices_;
    }
    text_ << "\n";
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

Status WriteTexture(const Patch& patch, const std::string& folder) {
  std::vector<std::uint8_t> png;
  cv::imencode(".png", patch.texture, png);
  return WriteFile(folder + "/" + TextureName(patch), std::string(png.begin(), png.end()));
}

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
    if (status.ok()) status = WriteTexture(patch, folder);
  }
  obj.AddCamera(camera, pose, 0.15 * pose.translation.norm());
  if (status.ok()) status = WriteFile(folder + "/model.mtl", materials.str());
  return status.ok() ? WriteFile(folder + "/model.obj", obj.text()) : status;
}

}  // namespace circline::apps
