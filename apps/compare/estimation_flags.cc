#include "apps/compare/estimation_flags.h"

#include <gflags/gflags.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "apps/common/noise_file.h"
#include "apps/common/text.h"
#include "circline/estimators/robust_loss.h"

DEFINE_string(
    robust_loss, circline::LossName(circline::LossOptions().type),
    "Robust losses of the refinement, a list sweeps: trivial, huber, soft_l_one, cauchy, arctan, "
    "tukey, geman_mcclure.");
DEFINE_string(
    loss_scale_px, "auto",
    "Standard deviation of a point's noise, pixels, or 'auto' (estimated); a list sweeps. A number "
    "also replaces what detection measured.");
DEFINE_string(conic_loss, "", "Loss of contour points, where it differs from --robust_loss.");
DEFINE_string(conic_loss_scale_px, "", "Scale of contour points, where it differs.");
DEFINE_string(line_loss, "", "Loss of points of lines, where it differs from --robust_loss.");
DEFINE_string(line_loss_scale_px, "", "Scale of points of lines, where it differs.");
DEFINE_string(conic_distance,
              circline::ConicDistanceName(circline::EstimationOptions().conic_distance),
              "Distance of contour points in the refinement: sampson (first order), orthogonal, or "
              "auto: orthogonal where the first order does not suffice.");
DEFINE_double(
    focal_sigma, -1.0,
    "Standard deviation of the logarithm of the camera's focal length (0.03: 3 %); from "
    "0.01 on it is refined too; 0 = exact. -1: by where the focal length is from: "
    "0.002 of a calibration that states none, 0.25 of --focal_px and --fov_deg, 0.05 of "
    "EXIF's, 0.5 where nothing is known; that of --noise=exact or of a --noise_model that "
    "states one comes before these.");
DEFINE_string(noise, "photo",
              "What is not exact beside the points' noise: photo (prints bleed, sheets bend, walls "
              "lean) or exact (nothing, for simulated evidence).");
DEFINE_string(noise_model, "",
              "A YAML or JSON file with standard deviations that differ from those of --noise; its "
              "keys are the fields of NoiseModel.");

namespace circline::apps {
namespace {

Status ParseLoss(const std::string& flag, const std::string& name, LossType* type) {
  if (LossFromName(name, type)) return Status::Ok();
  return Status::Invalid("--" + flag + ": " + NotOneOf(name, LossNames()));
}

Status ParseScale(const std::string& flag, const std::string& text, double* scale) {
  if (text == "auto") {
    *scale = 0.0;
    return Status::Ok();
  }
  if (ParseDouble(text, scale) && *scale > 0.0) return Status::Ok();
  return Status::Invalid("--" + flag + ": '" + text + "' is neither a positive number nor 'auto'");
}

// What --conic_loss or --line_loss and their scales say; absent where they are empty.
struct LossOverride {
  std::optional<LossType> type;
  std::optional<double> scale_px;

  Status Read(const std::string& flag, const std::string& loss, const std::string& scale) {
    if (!loss.empty()) {
      const Status status = ParseLoss(flag, loss, &type.emplace());
      if (!status.ok()) return status;
    }
    return scale.empty() ? Status::Ok()
                         : ParseScale(flag + "_scale_px", scale, &scale_px.emplace());
  }
  LossOptions Apply(const LossOptions& common) const {
    return {type.value_or(common.type), scale_px.value_or(common.scale_px)};
  }
};

Status ReadFocalSigma(const NoiseModel& noise, std::optional<CameraSigma>* sigma) {
  if (FLAGS_focal_sigma == -1.0) return Status::Ok();
  if (!(FLAGS_focal_sigma >= 0.0) || !std::isfinite(FLAGS_focal_sigma))
    return Status::Invalid(
        "--focal_sigma must be a finite number of 0 or more, or -1: by where the focal length is "
        "from");
  *sigma = noise.camera;
  (*sigma)->log_focal = FLAGS_focal_sigma;
  return Status::Ok();
}

}  // namespace

Status NoiseFromFlags(NoiseModel* model, CameraGuess* guess) {
  if (FLAGS_noise != "exact" && FLAGS_noise != "photo") {
    return Status::Invalid("--noise: " + NotOneOf(FLAGS_noise, {"photo", "exact"}));
  }
  *model = FLAGS_noise == "exact" ? NoiseModel::Exact() : NoiseModel();
  guess->is_exact = FLAGS_noise == "exact";
  if (FLAGS_noise_model.empty()) return Status::Ok();
  const Status status = ReadNoiseModel(FLAGS_noise_model, model, &guess->stated);
  return status.ok() ? status : Status::Invalid("--noise_model: " + status.message);
}

Status LossesFromFlags(const NoiseModel& noise, std::vector<LossSetting>* losses) {
  LossOverride conic, line;
  Status status = conic.Read("conic_loss", FLAGS_conic_loss, FLAGS_conic_loss_scale_px);
  if (status.ok()) status = line.Read("line_loss", FLAGS_line_loss, FLAGS_line_loss_scale_px);
  EstimationOptions common_options;
  if (status.ok() && !ConicDistanceFromName(FLAGS_conic_distance, &common_options.conic_distance)) {
    status = Status::Invalid("--conic_distance: " +
                             NotOneOf(FLAGS_conic_distance, {"auto", "sampson", "orthogonal"}));
  }
  common_options.noise_model = noise;
  if (status.ok()) status = ReadFocalSigma(noise, &common_options.camera_sigma);
  if (!status.ok()) return status;
  losses->clear();
  for (const std::string& loss : SplitList(FLAGS_robust_loss)) {
    LossOptions common;
    status = ParseLoss("robust_loss", loss, &common.type);
    for (const std::string& scale : SplitList(FLAGS_loss_scale_px)) {
      if (status.ok()) status = ParseScale("loss_scale_px", scale, &common.scale_px);
      LossSetting setting{loss, common.scale_px, common_options};
      setting.estimation.conic_loss = conic.Apply(common);
      setting.estimation.line_loss = line.Apply(common);
      if (status.ok()) status = setting.estimation.Validate();
      if (!status.ok()) return status;
      const bool twice = std::any_of(losses->begin(), losses->end(), [&](const LossSetting& other) {
        return other.loss == setting.loss && other.scale_px == setting.scale_px;
      });
      if (!twice) losses->push_back(setting);
    }
  }
  return Status::Ok();
}

}  // namespace circline::apps
