// The noise model, the camera's uncertainty and the losses, from the flags.
#ifndef CIRCLINE_APPS_COMPARE_ESTIMATION_FLAGS_H_
#define CIRCLINE_APPS_COMPARE_ESTIMATION_FLAGS_H_

#include <string>
#include <vector>

#include "apps/compare/camera_guess.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/status.h"
#include "circline/refine/estimate_pose.h"

namespace circline::apps {

// One point of the sweep over losses and scales.
struct LossSetting {
  std::string loss;              // As given to --robust_loss.
  double scale_px = 0.0;         // As given to --loss_scale_px; 0 = auto.
  EstimationOptions estimation;  // With the overrides for conics and lines.
};

// --noise and the file of --noise_model, and what these say of a camera that is a guess. Not ok:
// one line that names the flag.
Status NoiseFromFlags(NoiseModel* model, CameraGuess* guess);

// Every loss with every scale. Their camera_sigma is what --focal_sigma says; absent where it
// leaves that to the noise model and the scene file. Not ok: one line that names the flag.
Status LossesFromFlags(const NoiseModel& noise, std::vector<LossSetting>* losses);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_ESTIMATION_FLAGS_H_
