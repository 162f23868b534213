#include <set>
#include <sstream>

#include "apps/common/colmap_file.h"
#include "apps/common/text.h"

namespace circline::apps {
namespace {

// What a COLMAP camera model's parameters mean, in order: fx and fy may be one (f).
struct ColmapCameraModel {
  const char* name;
  CameraModel model;
  bool one_focal_length;
  std::vector<int> distortion;  // Position in Camera::distortion of each further parameter.
};

const std::vector<ColmapCameraModel>& ColmapCameraModels() {
  static const auto* const models = new std::vector<ColmapCameraModel>{
      {"SIMPLE_PINHOLE", CameraModel::kPinhole, true, {}},
      {"PINHOLE", CameraModel::kPinhole, false, {}},
      {"SIMPLE_RADIAL", CameraModel::kOpenCV, true, {0}},
      {"RADIAL", CameraModel::kOpenCV, true, {0, 1}},
      {"OPENCV", CameraModel::kOpenCV, false, {0, 1, 2, 3}},
      {"FULL_OPENCV", CameraModel::kOpenCV, false, {0, 1, 2, 3, 4, 5, 6, 7}},
      {"OPENCV_FISHEYE", CameraModel::kFisheye, false, {0, 1, 2, 3}},
      {"SIMPLE_RADIAL_FISHEYE", CameraModel::kFisheye, true, {0}},
      {"RADIAL_FISHEYE", CameraModel::kFisheye, true, {0, 1}},
  };
  return *models;
}

Status CameraModelByName(const std::string& name, const ColmapCameraModel** model) {
  std::vector<std::string> names;
  for (const ColmapCameraModel& candidate : ColmapCameraModels()) {
    names.emplace_back(candidate.name);
    if (name == candidate.name) {
      *model = &candidate;
      return Status::Ok();
    }
  }
  return Status::Invalid("camera model " + NotOneOf(name, names));
}

}  // namespace

Status NumColmapParameters(const std::string& name, std::size_t* number) {
  const ColmapCameraModel* model = nullptr;
  const Status status = CameraModelByName(name, &model);
  if (status.ok()) *number = (model->one_focal_length ? 3 : 4) + model->distortion.size();
  return status;
}

Status SetColmapCamera(const std::string& name, const std::vector<double>& parameters,
                       Camera* camera) {
  const ColmapCameraModel* of = nullptr;
  const Status status = CameraModelByName(name, &of);
  if (!status.ok()) return status;
  const ColmapCameraModel& model = *of;
  const std::size_t num_focal = model.one_focal_length ? 1 : 2;
  const std::size_t num_expected = num_focal + 2 + model.distortion.size();
  if (parameters.size() != num_expected) {
    return Status::Invalid(std::string(model.name) + " has " + std::to_string(num_expected) +
                           " parameters, not " + std::to_string(parameters.size()));
  }
  camera->model = model.model;
  camera->fx = parameters[0];
  camera->fy = parameters[num_focal - 1];
  camera->cx = parameters[num_focal] - 0.5;
  camera->cy = parameters[num_focal + 1] - 0.5;
  for (std::size_t k = 0; k < model.distortion.size(); ++k)
    camera->distortion[static_cast<std::size_t>(model.distortion[k])] =
        parameters[num_focal + 2 + k];
  return camera->Validate();
}

namespace {

// One line "ID MODEL WIDTH HEIGHT PARAMS...".
Status ParseColmapCamera(const std::string& line, Camera* camera) {
  std::istringstream stream(line);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  if (words.size() < 5) {
    return Status::Invalid("neither an OpenCV calibration nor a line of a COLMAP cameras.txt");
  }
  std::vector<double> parameters;
  for (std::size_t i = 4; i < words.size(); ++i) {
    double value = 0.0;
    if (!ParseDouble(words[i], &value)) return Status::Invalid("'" + words[i] + "' is no number");
    parameters.push_back(value);
  }
  if (!ParseInt(words[2], &camera->width) || !ParseInt(words[3], &camera->height)) {
    return Status::Invalid("width and height must be whole numbers");
  }
  camera->id = words[0];
  return SetColmapCamera(words[1], parameters, camera);
}

}  // namespace

Status ParseColmapCameras(const std::string& path, const std::string& text,
                          std::vector<Camera>* cameras) {
  std::istringstream lines(text);
  std::set<std::string> ids;
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const std::size_t begin = line.find_first_not_of(" \t\r");
    if (begin == std::string::npos || line[begin] == '#') continue;
    Camera camera;
    Status status = ParseColmapCamera(line, &camera);
    if (status.ok() && !ids.insert(camera.id).second) {
      status = Status::Invalid("camera " + camera.id + " stands there twice");
    }
    if (!status.ok()) {
      return Status::Invalid(path + ": line " + std::to_string(number) + ": " + status.message);
    }
    cameras->push_back(camera);
  }
  return cameras->empty() ? Status::Invalid(path + ": has no camera") : Status::Ok();
}

}  // namespace circline::apps
