#include "circline/refine/adjust_photos.h"

#include <algorithm>
#include <cmath>

#include "circline/refine/many/adjustment.h"

namespace circline {

const char* RigidWorldName(RigidWorld rigid) {
  return rigid == RigidWorld::kAuto ? "auto" : rigid == RigidWorld::kYes ? "yes" : "no";
}

bool RigidWorldFromName(const std::string& name, RigidWorld* rigid) {
  for (const RigidWorld known : {RigidWorld::kAuto, RigidWorld::kYes, RigidWorld::kNo}) {
    if (name != RigidWorldName(known)) continue;
    *rigid = known;
    return true;
  }
  return false;
}

Status AdjustOptions::Validate() const {
  Status status = PoseOptions(*this).Validate();
  for (const auto& [id, sigma] : camera_sigma) {
    if (status.ok()) status = sigma.Validate();
  }
  if (!status.ok()) return status;
  if (!(tangential_sigma >= 0.0) || !std::isfinite(tangential_sigma))
    return Status::Invalid("tangential_sigma must be 0 or more");
  if (!(nearly_equal >= 0.0) || !std::isfinite(nearly_equal))
    return Status::Invalid("nearly_equal must be 0 or more");
  if (!(given_rotation_sigma > 0.0) || !std::isfinite(given_rotation_sigma))
    return Status::Invalid("given_rotation_sigma must be positive");
  if (!(given_translation_sigma > 0.0) || !std::isfinite(given_translation_sigma))
    return Status::Invalid("given_translation_sigma must be positive");
  if (!given_poses.empty() && rigid != RigidWorld::kAuto) {
    return Status::Invalid(
        "rigid must be auto where poses are given: their world is one, and circles are the same "
        "where they lie, whatever their ids");
  }
  if (num_radial < 0 || num_radial > 4) return Status::Invalid("num_radial must be from 0 to 4");
  if (max_iterations < 1) return Status::Invalid("max_iterations must be 1 or more");
  if (num_solver_threads < 1) return Status::Invalid("num_solver_threads must be 1 or more");
  if (num_threads < 1) return Status::Invalid("num_threads must be 1 or more");
  return Status::Ok();
}

CameraSigma UnknownCamera(const Camera& camera) {
  constexpr double kOfDiagonal = 0.03;  // Of 5 calibrated cameras: 0.005 to 0.028.
  constexpr double kSquare = 0.001;
  constexpr double kK1 = 0.3;  // Of 5 calibrated cameras the widest has -0.45.
  // What the projections that lenses are built for have beside the equidistant one: from -1/6
  // (orthographic) to 1/12 (stereographic).
  constexpr double kFisheyeK1 = 0.1;
  // A photo of unknown size has its principal point in the middle.
  const double width = camera.width > 0 ? camera.width : 2.0 * camera.cx;
  const double height = camera.height > 0 ? camera.height : 2.0 * camera.cy;
  return {0.7, kSquare, kOfDiagonal * std::hypot(width, height),
          camera.model == CameraModel::kFisheye ? kFisheyeK1 : kK1};
}

const char* ShiftName(CameraModel model, int shift) {
  static constexpr const char* kNames[] = {"focal length", "aspect", "cx", "cy"};
  static constexpr const char* kOpenCV[] = {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
  static constexpr const char* kFisheye[] = {"k1", "k2", "k3", "k4", "k5", "k6", "k7", "k8"};
  if (shift < 4) return kNames[shift];
  return (model == CameraModel::kFisheye ? kFisheye : kOpenCV)[shift - 4];
}

double AdjustedCamera::Sigma(int shift) const {
  return std::sqrt(covariance[static_cast<std::size_t>(shift * (kCameraSize + 1))]);
}

namespace {

// Fits and detection may have gone on to a likelier camera than the one that was given.
bool HasFoundCamera(const Observations& photo) {
  return photo.stated_focal_px > 0.0 || photo.found_k1 != 0.0;
}

void SetBackCamera(Observations* photo) {
  Camera& camera = photo->camera;
  if (photo->stated_focal_px > 0.0) {
    camera.fy *= photo->stated_focal_px / camera.fx;
    camera.fx = photo->stated_focal_px;
  }
  camera.distortion[0] -= photo->found_k1;
  photo->stated_focal_px = photo->found_k1 = 0.0;
}

}  // namespace

AdjustedPhotos AdjustPhotos(const std::vector<Observations>& photos, const AdjustOptions& options) {
  if (std::none_of(photos.begin(), photos.end(), HasFoundCamera))
    return Adjustment(photos, options).Run();
  std::vector<Observations> given = photos;
  for (Observations& photo : given) SetBackCamera(&photo);
  return Adjustment(given, options).Run();
}

}  // namespace circline
