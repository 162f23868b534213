#include "apps/compare/export.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "apps/common/output_file.h"
#include "apps/common/text.h"
#include "apps/compare/record_files.h"

namespace circline::apps {
namespace {

using Json = nlohmann::ordered_json;

constexpr char kNoPoints[] = "# no points\n", kTumHeader[] = "# time tx ty tz qx qy qz qw\n",
               kGenerator[] = "circline_compare";

// COLMAP's model and its parameters; its pixel centres lie at half integers.
std::string ColmapCamera(const Camera& camera) {
  const auto& d = camera.distortion;
  const bool rational = std::any_of(d.begin() + 4, d.end(), [](double k) { return k != 0.0; });
  const bool fisheye = camera.model == CameraModel::kFisheye;
  const bool pinhole = camera.model == CameraModel::kPinhole;
  const std::size_t num_distortion = pinhole ? 0 : !fisheye && rational ? 8 : 4;
  std::ostringstream text;
  text.precision(17);
  text << (pinhole    ? "PINHOLE"
           : fisheye  ? "OPENCV_FISHEYE"
           : rational ? "FULL_OPENCV"
                      : "OPENCV")
       << " " << camera.width << " " << camera.height << " " << camera.fx << " " << camera.fy << " "
       << camera.cx + 0.5 << " " << camera.cy + 0.5;
  for (std::size_t i = 0; i < num_distortion; ++i) text << " " << d[i];
  return text.str();
}

Status ExportColmap(const std::vector<ExportedPose>& poses, const std::string& folder,
                    std::string* note) {
  std::ostringstream images, cameras;
  images.precision(17);
  images << "# IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n"
            "# then its points, of which there are none\n";
  cameras << "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
  std::map<std::string, std::size_t> camera_ids;  // By text.
  std::vector<std::string> left_out;              // Names.
  for (const ExportedPose& pose : poses) {
    // COLMAP would read it up to there, and find no such photo, or another one.
    if (pose.name.find_first_of(" \t\r\n") != std::string::npos) {
      left_out.push_back("'" + pose.name + "'");
      continue;
    }
    const auto [camera, is_new] =
        camera_ids.emplace(ColmapCamera(pose.camera), camera_ids.size() + 1);
    if (is_new) cameras << camera->second << " " << camera->first << "\n";
    const Eigen::Quaterniond q(pose.cam_from_world.rotation);
    const Eigen::Vector3d& t = pose.cam_from_world.translation;
    images << pose.index + 1 << " " << q.w() << " " << q.x() << " " << q.y() << " " << q.z() << " "
           << t.x() << " " << t.y() << " " << t.z() << " " << camera->second << " " << pose.name
           << "\n\n";
  }
  if (!left_out.empty()) {
    images << "# without " << left_out.size() << " whose names have spaces\n";
    *note = "images.txt is without photos whose names COLMAP cannot read, for their spaces: " +
            JoinList(left_out, ", ");
  }
  Status status = WriteFile(folder + "/images.txt", images.str());
  if (status.ok()) status = WriteFile(folder + "/cameras.txt", cameras.str());
  return status.ok() ? WriteFile(folder + "/points3D.txt", kNoPoints) : status;
}

Status ExportGltf(const std::vector<ExportedPose>& poses, const std::string& folder) {
  Json gltf, cameras = Json::array(), children = Json::array(), nodes = Json::array();
  nodes.push_back({{"name", "world"}, {"rotation", GltfUpright()}});
  for (const ExportedPose& pose : poses) {
    const GltfPerspective perspective = GltfPerspectiveOf(pose.camera);
    const Json camera = {{"type", "perspective"},
                         {"name", pose.camera.id},
                         {"perspective",
                          {{"yfov", perspective.yfov},
                           {"aspectRatio", perspective.aspect_ratio},
                           {"znear", kGltfNear}}}};
    const auto known = std::find(cameras.begin(), cameras.end(), camera);
    const auto id = known - cameras.begin();
    if (known == cameras.end()) cameras.push_back(camera);
    const GltfNode node = GltfCameraNode(pose.cam_from_world);
    children.push_back(nodes.size());
    nodes.push_back({{"name", pose.name},
                     {"camera", id},
                     {"translation", node.translation},
                     {"rotation", node.rotation}});
  }
  if (!children.empty()) nodes[0]["children"] = children;
  gltf["asset"] = {{"version", "2.0"}, {"generator", kGenerator}};
  gltf["scene"] = 0;
  gltf["scenes"] = Json::array({{{"nodes", {0}}}});
  gltf["nodes"] = nodes;
  if (!cameras.empty()) gltf["cameras"] = cameras;
  return WriteFile(folder + "/cameras.gltf",
                   gltf.dump(1, ' ', false, Json::error_handler_t::replace) + "\n");
}

Status ExportTum(const std::vector<ExportedPose>& poses, const std::string& folder) {
  std::ostringstream lines;
  lines.precision(17);
  lines << kTumHeader;
  for (const ExportedPose& pose : poses) {
    const std::string stem = std::filesystem::path(pose.name).stem().string();
    double time = 0.0;
    const Eigen::Matrix3d& rotation = pose.cam_from_world.rotation;
    const Eigen::Vector3d center = -(rotation.transpose() * pose.cam_from_world.translation);
    const Eigen::Quaterniond q(rotation.transpose().eval());
    lines << (pose.time_s                ? FormatFixed(*pose.time_s, 6)
              : ParseDouble(stem, &time) ? stem
                                         : std::to_string(pose.index))
          << " " << center.x() << " " << center.y() << " " << center.z() << " " << q.x() << " "
          << q.y() << " " << q.z() << " " << q.w() << "\n";
  }
  return WriteFile(folder + "/trajectory.txt", lines.str());
}

// What stands near the beginning of its last file, and in no other program's.
const char* MarkOf(const std::string& format) {
  return format == "colmap" ? kNoPoints : format == "gltf" ? kGenerator : kTumHeader;
}

// Programs take all poses of a file for one world of one unit.
std::string ScaleNote(std::size_t num_poses, int num_metric) {
  if (static_cast<std::size_t>(num_metric) == num_poses) return "";
  return "exported poses: " + std::to_string(num_metric) + " of " + std::to_string(num_poses) +
         " have a scale, by a known radius or length; without, a translation has length 1, "
         "whatever the distance\n";
}

}  // namespace

std::array<double, 4> GltfUpright() {
  const double half = std::sqrt(0.5);
  return {-half, 0.0, 0.0, half};
}

GltfNode GltfCameraNode(const CameraPose& pose) {
  const Eigen::Vector3d center = -(pose.rotation.transpose() * pose.translation);
  const Eigen::Matrix3d world_from_gltf =
      pose.rotation.transpose() * Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
  const Eigen::Quaterniond q(world_from_gltf);
  return {{center.x(), center.y(), center.z()}, {q.x(), q.y(), q.z(), q.w()}};
}

GltfPerspective GltfPerspectiveOf(const Camera& camera) {
  const double half_x = 0.5 * camera.width / camera.fx, half_y = 0.5 * camera.height / camera.fy;
  return {2.0 * std::atan(half_y), half_x / half_y};
}

const std::vector<ExportFormat>& ExportFormats() {
  static const auto* const formats =
      new std::vector<ExportFormat>{{"colmap", {"images.txt", "cameras.txt", "points3D.txt"}},
                                    {"gltf", {"cameras.gltf"}},
                                    {"tum", {"trajectory.txt"}}};
  return *formats;
}

std::vector<std::string> ExportedFilesIn(const std::string& folder) {
  constexpr std::size_t kHead = 256;
  std::vector<std::string> names;
  for (const ExportFormat& format : ExportFormats()) {
    std::ifstream file(folder + "/" + format.files.back(), std::ios::binary);
    std::string head(kHead, '\0');
    file.read(head.data(), kHead);
    if (head.find(MarkOf(format.name)) != std::string::npos)
      names.insert(names.end(), format.files.begin(), format.files.end());
  }
  return names;
}

Status ExportPoses(const std::string& format, const std::vector<ExportedPose>& poses,
                   const std::string& folder, std::string* note) {
  note->clear();
  if (format == "colmap") return ExportColmap(poses, folder, note);
  return format == "gltf" ? ExportGltf(poses, folder) : ExportTum(poses, folder);
}

Status WriteExports(const std::string& folder, const std::vector<std::string>& formats,
                    std::string* notes) {
  if (formats.empty()) return Status::Ok();
  RecordReader reader(folder);
  ImageRecord record;
  std::vector<ExportedPose> poses;
  int num_metric = 0;
  for (ImageLines lines; reader.Next(&lines);) {
    const Status status = ParseRecord(lines, &record);
    if (!status.ok()) return status;
    const SolverRecord* shown = AnswerToShow(record.solvers);
    if (shown == nullptr) continue;
    const HypothesisRecord& best = shown->hypotheses.front();
    num_metric += best.metric ? 1 : 0;
    poses.push_back({record.name,
                     record.index,
                     best.camera.value_or(record.camera),
                     {best.rotation, best.translation}});
  }
  for (const std::string& format : formats) {
    std::string note;
    const Status status = ExportPoses(format, poses, folder, &note);
    if (!status.ok()) return status;
    if (!note.empty()) *notes += note + "\n";
  }
  *notes += ScaleNote(poses.size(), num_metric);
  return Status::Ok();
}

}  // namespace circline::apps
