#include "apps/calibrate/calibration_files.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <set>
#include <sstream>

#include "apps/calibrate/calibration_report.h"
#include "apps/common/camera_file.h"
#include "apps/common/document.h"
#include "apps/common/output_file.h"
#include "apps/common/storage_node.h"
#include "apps/common/text.h"
#include "apps/common/written_files.h"
#include "apps/compare/export.h"

namespace circline::apps {

std::string WhyLeftOut(const AdjustedPhoto& photo, const std::vector<std::string>& names) {
  if (photo.same_as < 0) return photo.status.message;
  return "it shows nearly the same as " + names[static_cast<std::size_t>(photo.same_as)] +
         ", whose errors it shares";
}

namespace {

using Json = nlohmann::ordered_json;

std::string CalibrationYaml(const AdjustedCamera& adjusted) {
  const Camera& camera = adjusted.camera;
  cv::FileStorage file("x.yml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
  const std::vector<double> distortion = Distortion(camera);
  file << "image_width" << camera.width << "image_height" << camera.height;
  if (camera.model == CameraModel::kFisheye) file << "fisheye_model" << 1;
  file << "camera_matrix"
       << cv::Mat((cv::Mat_<double>(3, 3) << camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy,
                   0.0, 0.0, 1.0));
  file << "distortion_coefficients" << cv::Mat(distortion).reshape(1, 1);
  file << "avg_reprojection_error" << adjusted.rms_px;
  return file.releaseAndGetString();
}

Json CameraJson(const AdjustedCamera& adjusted) {
  const Camera& camera = adjusted.camera;
  const std::vector<double> d = Distortion(camera);
  const double f = adjusted.Sigma(0), aspect = adjusted.Sigma(1);
  Json sigma = {{"fx", camera.fx * f},
                {"fy", camera.fy * std::hypot(f, aspect)},
                {"cx", adjusted.Sigma(2)},
                {"cy", adjusted.Sigma(3)}};
  for (std::size_t k = 0; k < d.size(); ++k)
    sigma["distortion"].push_back(adjusted.Sigma(4 + static_cast<int>(k)));
  Json correlation = Json::array();
  for (int i = 0; i < kCameraSize; ++i) {
    Json row = Json::array();
    for (int j = 0; j < kCameraSize; ++j) {
      const double both = adjusted.Sigma(i) * adjusted.Sigma(j);
      row.push_back(both > 0.0
                        ? adjusted.covariance[static_cast<std::size_t>(i * kCameraSize + j)] / both
                        : 0.0);
    }
    correlation.push_back(row);
  }
  return {{"id", camera.id},
          {"model", ModelName(camera.model)},
          {"width", camera.width},
          {"height", camera.height},
          {"fx", camera.fx},
          {"fy", camera.fy},
          {"cx", camera.cx},
          {"cy", camera.cy},
          {"distortion", d},
          {"sigma", sigma},
          {"at_prior", adjusted.at_prior},
          {"correlation", correlation},
          {"sigma_by_photos", adjusted.sigma_by_photos},
          {"num_images", adjusted.num_photos},
          {"rms_px", adjusted.rms_px}};
}

Json PhotoJson(const AdjustedPhoto& photo, std::size_t index,
               const std::vector<std::string>& names) {
  Json out = {{"file", names[index]},
              {"status", photo.status.ok() ? "ok" : "refused"},
              {"message", WhyLeftOut(photo, names)}};
  if (!photo.status.ok()) return out;
  out["rotation"] = JsonNumbers(photo.cam_from_world.rotation);
  out["translation"] = JsonNumbers(photo.cam_from_world.translation);
  out["covariance"] = photo.covariance;
  out["left_out"] = photo.left_out;
  out["rms_px"] = photo.rms_px;
  out["misfit"] = photo.misfit;
  if (photo.num_grid_lines > 0) out["grid_lines"] = photo.num_grid_lines;
  return out;
}

Json SceneEntry(const AdjustedCamera& made) {
  StatedCameraSigma sigma;  // One that is held has no deviation, and nothing is said of it.
  const double point = std::max(made.Sigma(2), made.Sigma(3));
  if (made.Sigma(0) > 0.0) sigma.log_focal = made.Sigma(0);
  if (point > 0.0) sigma.principal_point_px = point;
  if (made.Sigma(4) > 0.0) sigma.k1 = made.Sigma(4);
  return CameraEntry(made.camera, sigma);
}

// Of the cameras, by their ids.
std::vector<std::string> CalibrationNames(const std::vector<std::string>& ids) {
  std::vector<std::string> names = UniqueStems(ids);
  for (std::size_t c = 0; c < names.size(); ++c)
    names[c] = c == 0 ? "calibration.yml" : "calibration_" + names[c] + ".yml";
  return names;
}

}  // namespace

void RemoveEarlierCalibration(const std::string& folder) {
  std::string text;
  if (!ReadTextFile(folder + "/calibration.json", &text).ok()) return;
  const Json earlier = Json::parse(text, nullptr, false);
  if (!earlier.is_object() || !earlier.contains("cameras")) return;
  std::vector<std::string> ids;
  for (const Json& camera : earlier["cameras"])
    if (camera.contains("id") && camera["id"].is_string()) ids.push_back(camera["id"]);
  RemoveFiles(folder, CalibrationNames(ids));
  const bool imported = ReadTextFile(folder + "/landmarks.json", &text).ok() &&
                        text.find("world_from_model") != std::string::npos;
  if (imported) RemoveFiles(folder, {"landmarks.json", "transform.txt"});
}

Status WriteCalibration(const AdjustedPhotos& adjusted, const std::vector<Observations>& photos,
                        const std::vector<std::string>& names,
                        const std::vector<std::string>& pictures, const std::string& folder,
                        std::string* note) {
  Json json = {{"rigid", adjusted.rigid}, {"metric", adjusted.metric}, {"cameras", Json::array()}};
  Status status;
  std::vector<std::string> ids;
  for (const AdjustedCamera& camera : adjusted.cameras) ids.push_back(camera.camera.id);
  const std::vector<std::string> files = CalibrationNames(ids);
  for (std::size_t c = 0; c < adjusted.cameras.size() && status.ok(); ++c) {
    json["cameras"].push_back(CameraJson(adjusted.cameras[c]));
    status = WriteFile(folder + "/" + files[c], CalibrationYaml(adjusted.cameras[c]));
  }
  std::vector<ExportedPose> poses;
  json["images"] = Json::array();
  for (std::size_t i = 0; i < photos.size(); ++i) {
    const AdjustedPhoto& photo = adjusted.photos[i];
    json["images"].push_back(PhotoJson(photo, i, names));
    if (!photo.status.ok()) continue;
    poses.push_back({names[i], i, adjusted.cameras[static_cast<std::size_t>(photo.camera)].camera,
                     photo.cam_from_world});
  }
  json["notes"] = adjusted.notes;
  if (status.ok()) status = WriteFile(folder + "/calibration.json", DocumentText(json));
  if (status.ok()) status = ExportPoses("colmap", poses, folder, note);
  if (!note->empty()) *note += "\n";
  if (status.ok())
    status = WriteFile(folder + "/report.html", CalibrationReport(adjusted, names, pictures));
  return status;
}

Status WriteCalibratedScene(const std::string& source, const AdjustedPhotos& adjusted,
                            const std::vector<SceneImage>& images, const std::string& path) {
  Json given, scene;
  if (!source.empty()) {
    const Status status = ReadStorage(source, &given);
    if (!status.ok()) return status;
  }
  if (given.contains("rigid")) scene["rigid"] = given["rigid"];
  std::set<std::string> ids;
  for (const AdjustedCamera& made : adjusted.cameras) {
    scene["cameras"].push_back(SceneEntry(made));
    ids.insert(made.camera.id);
  }
  for (const SceneImage& image : images) {
    const std::string& id = image.observations.camera.id;
    if (ids.count(id) == 0) continue;  // No photo of that camera could be read.
    Json entry;
    if (!source.empty()) entry = given["images"][image.index];
    entry["file"] = std::filesystem::absolute(image.path).lexically_normal().string();
    entry["camera"] = id;
    scene["images"].push_back(std::move(entry));
  }
  return WriteFile(path, DocumentText(scene));
}

std::string CalibrationTable(const AdjustedPhotos& adjusted,
                             const std::vector<std::string>& names) {
  std::ostringstream out;
  for (const AdjustedCamera& made : adjusted.cameras) {
    if (made.num_photos == 0) {
      out << "camera '" << made.camera.id << "': no photo of it takes part\n";
      continue;
    }
    const Camera& camera = made.camera;
    out << "camera '" << camera.id << "', " << made.num_photos
        << (made.num_photos == 1 ? " photo, " : " photos, ")
        << (adjusted.rigid ? "one world" : "each photo a world of its own") << ", rms "
        << FormatShort(made.rms_px) << " px\n";
    out << "  focal length " << FormatFixed(camera.fx, 2) << " +- "
        << FormatShort(made.SigmaFocalPx(), 2) << " px\n";
    if (camera.fy != camera.fx) out << "  fy " << FormatFixed(camera.fy, 2) << " px\n";
    out << "  principal point " << FormatFixed(camera.cx, 1) << " " << FormatFixed(camera.cy, 1)
        << " +- " << FormatShort(made.Sigma(2), 2) << " " << FormatShort(made.Sigma(3), 2)
        << " px\n";
    for (std::size_t k = 0; k < camera.distortion.size(); ++k) {
      if (made.Sigma(4 + static_cast<int>(k)) > 0.0)
        out << "  " << ShiftName(camera.model, 4 + static_cast<int>(k)) << " "
            << FormatShort(camera.distortion[k], 4) << " +- "
            << FormatShort(made.Sigma(4 + static_cast<int>(k)), 2) << "\n";
    }
    if (!made.at_prior.empty())
      out << "  the photos say next to nothing of: " << JoinList(made.at_prior, ", ") << "\n";
  }
  for (std::size_t c = 0; c < adjusted.cameras.size(); ++c) {
    for (const std::string& sentence : Advice(adjusted, static_cast<int>(c)))
      out << (adjusted.cameras.size() > 1 ? "  '" + adjusted.cameras[c].camera.id + "': " : "  ")
          << sentence << "\n";
  }
  for (const std::string& note : adjusted.notes) out << "  " << note << "\n";
  constexpr int kMostNamed = 20;  // All are in calibration.json and the report.
  int left_out = 0;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (adjusted.photos[i].status.ok() || ++left_out > kMostNamed) continue;
    const std::string why = WhyLeftOut(adjusted.photos[i], names);
    const std::size_t detail = adjusted.photos[i].same_as < 0 ? why.find(" (") : std::string::npos;
    out << names[i] << ": left out, " << why.substr(0, detail) << "\n";
  }
  if (left_out > kMostNamed) out << "and " << left_out - kMostNamed << " more are left out\n";
  return out.str();
}

}  // namespace circline::apps
