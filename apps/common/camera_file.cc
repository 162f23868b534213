#include "apps/common/camera_file.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include "apps/common/colmap_file.h"
#include "apps/common/text.h"

namespace circline::apps {
namespace {

constexpr const char* kModels[] = {"pinhole", "opencv", "fisheye"};  // In CameraModel's order.

void SetIntrinsics(const StorageNode& matrix_node, Camera* camera) {
  const std::vector<double> k = matrix_node.Numbers(9);
  if (k.empty()) return;
  camera->fx = k[0];
  camera->fy = k[4];
  camera->cx = k[2];
  camera->cy = k[5];
  if (!(camera->fx > 0.0) || !(camera->fy > 0.0)) {
    matrix_node.Fail("focal lengths fx (number 1) and fy (number 5) must be positive");
  } else if (std::abs(k[1]) > 1e-9 * camera->fx || k[3] != 0.0) {
    matrix_node.Fail("skew (number 2) is not supported: it must be 0");
  } else if (k[6] != 0.0 || k[7] != 0.0 || k[8] != 1.0) {
    matrix_node.Fail("must be fx 0 cx 0 fy cy 0 0 1, row by row");
  }
}

// How many coefficients `model` takes: OpenCV writes 4, 5, 8, 12 or 14, of which we use up to 8.
void SetDistortion(const StorageNode& node, Camera* camera) {
  if (!node.Exists()) return;
  const std::vector<double> d = node.Numbers();
  const std::size_t used = camera->model == CameraModel::kFisheye ? 4 : 8;
  const std::vector<std::size_t> sizes = camera->model == CameraModel::kFisheye
                                             ? std::vector<std::size_t>{0, 4}
                                             : std::vector<std::size_t>{0, 4, 5, 8, 12, 14};
  // A pinhole camera may have any number of zeros; that they are is for Camera::Validate to say.
  if (camera->model != CameraModel::kPinhole &&
      std::find(sizes.begin(), sizes.end(), d.size()) == sizes.end()) {
    node.Fail(camera->model == CameraModel::kFisheye
                  ? "the fisheye model has 4 coefficients (k1 k2 k3 k4), not " +
                        std::to_string(d.size())
                  : "the opencv model has 4, 5 or 8 coefficients (k1 k2 p1 p2 k3 k4 k5 k6), not " +
                        std::to_string(d.size()));
    return;
  }
  for (std::size_t i = 0; i < d.size(); ++i) {
    if (i < used) {
      camera->distortion[i] = d[i];
    } else if (d[i] != 0.0) {
      node.Fail("thin prism and tilt coefficients are not supported: numbers 9 and up must be 0");
    }
  }
}

void CheckCamera(const StorageNode& node, const Camera& camera) {
  if (!node.ok()) return;
  const Status status = camera.Validate();
  if (!status.ok()) node.Fail(status.message);
}

int ReadSize(const StorageNode& node) {
  if (!node.Exists()) return 0;
  const int value = node.Integer();
  if (value < 0) node.Fail("must be 0 (not known) or more");
  return value;
}

void ReadSigma(const StorageNode& node, std::optional<double>* sigma) {
  if (!node.Exists()) return;
  *sigma = node.Number();
  if (!(**sigma >= 0.0) || !std::isfinite(**sigma)) node.Fail("must be 0 (exact) or more");
}

// The first of the names that exists, else the first: files of older OpenCV samples spell
// differently.
StorageNode GetAny(const StorageNode& node, const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    if (node.Get(name).Exists()) return node.Get(name);
  }
  return node.Get(names.front());
}

// OpenCV's samples say fisheye_model: 1, ROS and Kalibr name the distortion.
CameraModel ReadDistortionModel(const StorageNode& root) {
  const StorageNode fisheye = root.Get("fisheye_model"), stated = root.Get("distortion_model");
  const bool is_fisheye = fisheye.Exists() && fisheye.Integer() != 0;
  const std::string name = stated.Exists() ? stated.Text() : "";
  const bool names_fisheye = name == "equidistant" || name == "fisheye";
  const std::vector<std::string> known = {"plumb_bob", "radtan", "rational_polynomial",
                                          "equidistant", "fisheye"};
  if (!name.empty() && std::find(known.begin(), known.end(), name) == known.end())
    stated.Fail(NotOneOf(name, known));
  if (!name.empty() && is_fisheye && !names_fisheye)
    stated.Fail("'" + name + "' is not the fisheye model that 'fisheye_model' states");
  return is_fisheye || names_fisheye ? CameraModel::kFisheye : CameraModel::kOpenCV;
}

Status ParseOpenCvCalibration(const std::string& path, const std::string& text,
                              std::vector<Camera>* cameras) {
  StorageNode::Json document;
  Status status = ParseStorage(path, text, &document);
  if (!status.ok()) return status;
  const StorageNode root(&document, path, &status);
  const StorageNode matrix = GetAny(root, {"camera_matrix", "Camera_Matrix", "cameraMatrix"});
  if (!matrix.Exists()) {
    root.Fail("'camera_matrix' is missing: a camera needs its focal length");
    return status;
  }
  Camera camera;
  camera.id = "camera";
  camera.model = ReadDistortionModel(root);
  camera.width = ReadSize(GetAny(root, {"image_width", "image_Width"}));
  camera.height = ReadSize(GetAny(root, {"image_height", "image_Height"}));
  SetIntrinsics(matrix, &camera);
  SetDistortion(GetAny(root, {"distortion_coefficients", "Distortion_Coefficients", "distCoeffs"}),
                &camera);
  CheckCamera(root, camera);
  if (status.ok()) cameras->push_back(camera);
  return status;
}

bool LooksLikeStorage(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t\r\n");
  if (begin == std::string::npos) return false;
  const std::string start = text.substr(begin, 5);
  return start[0] == '%' || start[0] == '{' || start[0] == '<' || start.compare(0, 3, "---") == 0 ||
         text.find("camera_matrix") != std::string::npos;
}

}  // namespace

const char* ModelName(CameraModel model) { return kModels[static_cast<std::size_t>(model)]; }

bool ModelFromName(const std::string& name, CameraModel* model) {
  const auto found = std::find(std::begin(kModels), std::end(kModels), name);
  if (found == std::end(kModels)) return false;
  *model = static_cast<CameraModel>(found - std::begin(kModels));
  return true;
}

std::string NoSuchModel(const std::string& name) {
  return NotOneOf(name, {std::begin(kModels), std::end(kModels)});
}

std::vector<double> Distortion(const Camera& camera) {
  if (camera.model == CameraModel::kPinhole) return std::vector<double>(4, 0.0);
  std::vector<double> d(camera.distortion.begin(), camera.distortion.end());
  const std::size_t least = camera.model == CameraModel::kFisheye ? 4 : 5;
  while (d.size() > least && d.back() == 0.0) d.pop_back();
  return d;
}

Status ReadCameraFile(const std::string& path, std::vector<Camera>* cameras) {
  cameras->clear();
  std::string text;
  const Status status = ReadTextFile(path, &text);
  if (!status.ok()) return status;
  const Status parsed = LooksLikeStorage(text) ? ParseOpenCvCalibration(path, text, cameras)
                                               : ParseColmapCameras(path, text, cameras);
  if (!parsed.ok()) cameras->clear();
  return parsed;
}

CameraSigma StatedCameraSigma::Over(CameraSigma sigma) const {
  sigma.log_focal = log_focal.value_or(sigma.log_focal);
  sigma.log_aspect = log_aspect.value_or(sigma.log_aspect);
  sigma.principal_point_px = principal_point_px.value_or(sigma.principal_point_px);
  sigma.k1 = k1.value_or(sigma.k1);
  sigma.doubtful_log_focal = doubtful_log_focal.value_or(sigma.doubtful_log_focal);
  return sigma;
}

CameraSigma StatedCameraSigma::OverCalibrated(const CameraSigma& sigma) const {
  CameraSigma stated = Over(sigma);
  // Where the focal length is a guess the lens tells it, by how it bends what is straight: so well
  // that what a calibration's k1 is off counts. Of 0.001 to 0.01 any will do
  // (circles-discocal-tir).
  constexpr double kCalibratedK1 = 0.001;
  if (stated.IsWide() && !k1) stated.k1 = std::max(stated.k1, kCalibratedK1);
  return stated;
}

Camera ReadSceneCamera(const StorageNode& node, StatedCameraSigma* sigma) {
  node.AllowKeys({"id", "model", "width", "height", "camera_matrix", "distortion", "focal_sigma",
                  "focal_sigma_doubtful", "principal_point_sigma_px", "k1_sigma"});
  Camera camera;
  camera.id = node.Require("id").Text();
  StorageNode named = node;
  named.set_place(node.place() + " (\"" + camera.id + "\")");
  const StorageNode model = named.Require("model");
  const std::string name = model.Text();
  if (!ModelFromName(name, &camera.model)) model.Fail(NoSuchModel(name));
  camera.width = ReadSize(named.Get("width"));
  camera.height = ReadSize(named.Get("height"));
  const StorageNode matrix = named.Get("camera_matrix");
  if (!matrix.Exists()) {
    named.Fail("'camera_matrix' is missing: a camera needs its focal length");
    return camera;
  }
  SetIntrinsics(matrix, &camera);
  SetDistortion(named.Get("distortion"), &camera);
  ReadSigma(named.Get("focal_sigma"), &sigma->log_focal);
  ReadSigma(named.Get("focal_sigma_doubtful"), &sigma->doubtful_log_focal);
  ReadSigma(named.Get("principal_point_sigma_px"), &sigma->principal_point_px);
  ReadSigma(named.Get("k1_sigma"), &sigma->k1);
  CheckCamera(named, camera);
  return camera;
}

nlohmann::ordered_json CameraEntry(const Camera& camera, const StatedCameraSigma& sigma) {
  nlohmann::ordered_json json = {{"id", camera.id}, {"model", ModelName(camera.model)}};
  if (camera.width > 0) json["width"] = camera.width;
  if (camera.height > 0) json["height"] = camera.height;
  json["camera_matrix"] = {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0};
  if (camera.model != CameraModel::kPinhole) json["distortion"] = Distortion(camera);
  const auto state = [&json](const char* key, const std::optional<double>& value) {
    if (value) json[key] = *value;
  };
  state("focal_sigma", sigma.log_focal);
  state("focal_sigma_doubtful", sigma.doubtful_log_focal);
  state("principal_point_sigma_px", sigma.principal_point_px);
  state("k1_sigma", sigma.k1);
  return json;
}

}  // namespace circline::apps
