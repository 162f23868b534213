#include "apps/compare/noise_flags.h"

#include <gflags/gflags.h>

#include <cmath>
#include <string>

#include "apps/common/noise_file.h"
#include "apps/common/text.h"

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

Status NoiseFromFlags(NoiseModel* model, CameraGuess* guess) {
  if (FLAGS_noise != "exact" && FLAGS_noise != "photo") {
    return Status::Invalid("--noise: '" + FLAGS_noise + "' is not one of photo, exact" +
                           DidYouMean(FLAGS_noise, {"photo", "exact"}));
  }
  *model = FLAGS_noise == "exact" ? NoiseModel::Exact() : NoiseModel();
  guess->is_exact = FLAGS_noise == "exact";
  if (FLAGS_noise_model.empty()) return Status::Ok();
  const Status status = ReadNoiseModel(FLAGS_noise_model, model, &guess->stated);
  return status.ok() ? status : Status::Invalid("--noise_model: " + status.message);
}

Status CameraSigmaFromFlags(const NoiseModel& noise, std::optional<CameraSigma>* sigma) {
  if (FLAGS_focal_sigma == -1.0) return Status::Ok();
  if (!(FLAGS_focal_sigma >= 0.0) || !std::isfinite(FLAGS_focal_sigma))
    return Status::Invalid(
        "--focal_sigma must be a finite number of 0 or more, or -1: by where the focal length is "
        "from");
  *sigma = noise.camera;
  (*sigma)->log_focal = FLAGS_focal_sigma;
  return Status::Ok();
}

}  // namespace circline::apps
