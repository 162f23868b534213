// What is not exact beside the noise of points, from the flags.
#ifndef CIRCLINE_APPS_COMPARE_NOISE_FLAGS_H_
#define CIRCLINE_APPS_COMPARE_NOISE_FLAGS_H_

#include <optional>

#include "apps/compare/camera_guess.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// --noise and the file of --noise_model, and what these say of a camera that is a guess. Not ok:
// one line that names the flag.
Status NoiseFromFlags(NoiseModel* model, CameraGuess* guess);

// What --focal_sigma says; absent where it leaves that to the noise model and the scene file.
Status CameraSigmaFromFlags(const NoiseModel& noise, std::optional<CameraSigma>* sigma);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_NOISE_FLAGS_H_
