#include "apps/calibrate/calibrate_options.h"

#include <gflags/gflags.h>

#include <algorithm>
#include <opencv2/core/utility.hpp>
#include <vector>

#include "apps/common/camera_file.h"
#include "apps/common/flags_util.h"
#include "apps/common/in_parallel.h"

DECLARE_string(camera);

DEFINE_string(model, "",
              "Camera model: pinhole, opencv or fisheye; empty: that of the camera given, opencv "
              "where it has no distortion.");
DEFINE_string(
    fix, "",
    "What is held as it is given, of: principal_point, aspect, k1, k2, k3, tangential; a "
    "list. Without, pixels are square to 0.1 % and tangential distortion is 0.0005, in three "
    "lenses of ten 0.005.");
DEFINE_string(free, "", "What may be far from that, of: aspect, tangential; a list.");
DEFINE_string(rigid, circline::RigidWorldName(circline::AdjustOptions().rigid),
              "Whether all photos show one sheet: yes, no (only the camera is common), or auto: "
              "where the circles of one id lie alike, or circles do whatever their ids.");
DEFINE_bool(
    square_grids, circline::AdjustOptions().square_grids,
    "Lines on a grid of equal squares, as a chessboard's, count as that: the camera is known "
    "better, and poses are in squares; and circles on one, as a sheet's. --nosquare_grids: as "
    "lines of two directions, and circles anywhere.");
DEFINE_string(
    import, "",
    "Folder of a COLMAP model (cameras and images, .bin or .txt) of the photos: its cameras "
    "and poses are taken as they are known, circles and directions are found in its "
    "world, and a known radius gives that its scale.");

namespace circline::apps {
namespace {

Status ModelFromFlag(std::optional<CameraModel>* model) {
  if (FLAGS_model.empty()) return Status::Ok();
  return ModelFromName(FLAGS_model, &model->emplace())
             ? Status::Ok()
             : Status::Invalid("--model: " + NoSuchModel(FLAGS_model));
}

Status ParametersFromFlags(CalibrateOptions* options) {
  std::vector<std::string> fixed, free;
  Status status = NamesFromFlag(
      "fix", FLAGS_fix, {"principal_point", "aspect", "k1", "k2", "k3", "tangential"}, &fixed);
  if (status.ok()) status = NamesFromFlag("free", FLAGS_free, {"aspect", "tangential"}, &free);
  if (!status.ok()) return status;
  const auto has = [](const std::vector<std::string>& names, const char* name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  for (const std::string& name : free) {
    if (has(fixed, name.c_str()))
      return Status::Invalid("--fix and --free both name '" + name + "'");
  }
  constexpr double kFreeAspect = 0.02, kFreeTangential = 0.01;
  options->fix_principal_point = has(fixed, "principal_point");
  if (has(fixed, "aspect")) options->aspect_sigma = 0.0;
  if (has(free, "aspect")) options->aspect_sigma = kFreeAspect;
  if (has(fixed, "tangential")) options->adjust.tangential_sigma = 0.0;
  if (has(free, "tangential")) options->adjust.tangential_sigma = kFreeTangential;
  options->adjust.num_radial = has(fixed, "k1")   ? 0
                               : has(fixed, "k2") ? 1
                               : has(fixed, "k3") ? 2
                                                  : 3;
  return Status::Ok();
}

}  // namespace

Status CalibrateOptionsFromFlags(CalibrateOptions* options) {
  Status status = OptionsFromFlags(&options->compare);
  if (status.ok()) status = CheckOneLoss(options->compare);
  if (status.ok()) status = ModelFromFlag(&options->model);
  if (status.ok()) status = ParametersFromFlags(options);
  if (status.ok() && !RigidWorldFromName(FLAGS_rigid, &options->adjust.rigid))
    status = Status::Invalid("--rigid=" + FLAGS_rigid + ": must be auto, yes or no");
  if (!status.ok()) return status;
  const CameraGuess& guess = options->compare.inputs.guess;
  if (!FLAGS_import.empty() &&
      (!FLAGS_camera.empty() || !FLAGS_model.empty() || guess.IsGiven() || !FLAGS_fix.empty() ||
       !FLAGS_free.empty() || options->adjust.rigid != RigidWorld::kAuto)) {
    return Status::Invalid(
        "--import brings its own cameras, and poses of one world: leave out --camera, --model, "
        "--focal_px, --fov_deg, --fix, --free and --rigid; --noise_model and --focal_sigma say how "
        "sure the cameras are");
  }
  options->import = FLAGS_import;
  options->compare.inputs.guess.is_exact = false;  // The camera is what is to be found.
  const EstimationOptions& estimation = options->compare.losses.front().estimation;
  options->adjust.square_grids = FLAGS_square_grids;
  options->adjust.conic_loss = estimation.conic_loss;
  options->adjust.line_loss = estimation.line_loss;
  options->adjust.noise_model = estimation.noise_model;
  UseThreads(options->compare.threads);
  options->adjust.num_threads = std::max(1, cv::getNumThreads());
  return status;
}

}  // namespace circline::apps
