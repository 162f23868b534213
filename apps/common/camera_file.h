// Cameras from files: OpenCV calibration files (YAML, JSON, XML) and COLMAP's cameras.txt.
#ifndef CIRCLINE_APPS_COMMON_CAMERA_FILE_H_
#define CIRCLINE_APPS_COMMON_CAMERA_FILE_H_

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "apps/common/storage_node.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// As in scene files.
const char* ModelName(CameraModel model);
// False, with `model` untouched, where no model has this name.
bool ModelFromName(const std::string& name, CameraModel* model);
// What a message says of one: "'fish' is not one of pinhole, opencv, fisheye".
std::string NoSuchModel(const std::string& name);
// In OpenCV's order; the rational terms only where they are there.
std::vector<double> Distortion(const Camera& camera);

// Every camera of the file; which kind of file it is shows in its content. COLMAP's pixel centres
// lie at half integers, ours at integers: the principal point moves by half a pixel. An OpenCV file
// gives one camera, with the id "camera"; `fisheye_model: 1` there means the fisheye model, as does
// a `distortion_model` of equidistant or fisheye, those of ROS and Kalibr; one that is not known is
// refused. Not ok: one line that names the file and what is wrong in it.
Status ReadCameraFile(const std::string& path, std::vector<Camera>* cameras);

// How well a scene file says that a camera is known; what it does not say is left to others.
struct StatedCameraSigma {
  std::optional<double> log_focal, log_aspect, principal_point_px, k1, doubtful_log_focal;

  bool IsAny() const {
    return log_focal || log_aspect || principal_point_px || k1 || doubtful_log_focal;
  }
  // `sigma` with what is stated in its place.
  CameraSigma Over(CameraSigma sigma) const;
  // The same of a camera that was calibrated, whose focal length may be a guess all the same.
  CameraSigma OverCalibrated(const CameraSigma& sigma) const;
};

// A camera of a scene file: id, model, width, height, camera_matrix, distortion; focal_sigma,
// focal_sigma_doubtful, principal_point_sigma_px, k1_sigma.
Camera ReadSceneCamera(const StorageNode& node, StatedCameraSigma* sigma);

// The same, to write: what `sigma` leaves open is not stated.
nlohmann::ordered_json CameraEntry(const Camera& camera, const StatedCameraSigma& sigma);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_CAMERA_FILE_H_
