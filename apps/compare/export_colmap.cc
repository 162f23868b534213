#include <Eigen/Geometry>
#include <algorithm>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "apps/common/output_file.h"
#include "apps/common/text.h"
#include "apps/compare/export.h"

namespace circline::apps {
namespace {

// COLMAP's model and its parameters; its pixel centres lie at half integers.
std::string CameraText(const Camera& camera) {
  const auto& d = camera.distortion;
  const bool rational = std::any_of(d.begin() + 4, d.end(), [](double k) { return k != 0.0; });
  const bool fisheye = camera.model == CameraModel::kFisheye;
  const bool pinhole = camera.model == CameraModel::kPinhole;
  const int num_distortion = pinhole ? 0 : !fisheye && rational ? 8 : 4;
  std::ostringstream text;
  text.precision(17);
  text << (pinhole    ? "PINHOLE"
           : fisheye  ? "OPENCV_FISHEYE"
           : rational ? "FULL_OPENCV"
                      : "OPENCV")
       << " " << camera.width << " " << camera.height << " " << camera.fx << " " << camera.fy << " "
       << camera.cx + 0.5 << " " << camera.cy + 0.5;
  for (int i = 0; i < num_distortion; ++i) text << " " << d[static_cast<std::size_t>(i)];
  return text.str();
}

class ColmapExporter : public Exporter {
 public:
  explicit ColmapExporter(std::string folder) : folder_(std::move(folder)) {
    images_.precision(17);
    images_ << "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n"
               "# then its points, of which there are none\n";
  }

  void Add(const ExportedPose& pose) override {
    // COLMAP would read it up to there, and find no such photo, or another one.
    if (pose.name.find_first_of(" \t\r\n") != std::string::npos) {
      left_out_.push_back("'" + pose.name + "'");
      return;
    }
    const int camera_id =
        cameras_.emplace(CameraText(pose.camera), static_cast<int>(cameras_.size()) + 1)
            .first->second;
    const Eigen::Quaterniond q(pose.rotation);
    const Eigen::Vector3d& t = pose.translation;
    images_ << pose.index + 1 << " " << q.w() << " " << q.x() << " " << q.y() << " " << q.z() << " "
            << t.x() << " " << t.y() << " " << t.z() << " " << camera_id << " " << pose.name
            << "\n\n";
  }

  Status Finish() override {
    std::map<int, std::string> by_id;
    for (const auto& [text, id] : cameras_) by_id[id] = text;
    std::string cameras = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
    for (const auto& [id, text] : by_id) cameras += std::to_string(id) + " " + text + "\n";
    std::string images = images_.str();
    if (!left_out_.empty())
      images += "# without " + std::to_string(left_out_.size()) + " whose names have spaces\n";
    Status status = WriteFile(folder_ + "/images.txt", images);
    if (status.ok()) status = WriteFile(folder_ + "/cameras.txt", cameras);
    if (status.ok()) status = WriteFile(folder_ + "/points3D.txt", "# no points\n");
    return status;
  }

  std::string Note() const override {
    if (left_out_.empty()) return "";
    return "images.txt is without photos whose names COLMAP cannot read, for their spaces: " +
           JoinList(left_out_, ", ");
  }

 private:
  std::string folder_;
  std::ostringstream images_;
  std::map<std::string, int> cameras_;  // By text: id.
  std::vector<std::string> left_out_;   // Names.
};

}  // namespace

std::unique_ptr<Exporter> MakeColmapExporter(const std::string& folder) {
  return std::make_unique<ColmapExporter>(folder);
}

}  // namespace circline::apps
