// A noise model from a file (docs: scene files). YAML or JSON.
#ifndef CIRCLINE_APPS_COMMON_NOISE_FILE_H_
#define CIRCLINE_APPS_COMMON_NOISE_FILE_H_

#include <string>

#include "apps/common/camera_file.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// The file's keys are the fields of NoiseModel; what it does not name stays as it is in `model`.
// Not ok: one line that names the file, the key and what is wrong there; `model` is then untouched.
// `stated`: what it says of the camera.
Status ReadNoiseModel(const std::string& path, NoiseModel* model,
                      StatedCameraSigma* stated = nullptr);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_NOISE_FILE_H_
