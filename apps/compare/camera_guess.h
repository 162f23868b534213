// What stands in for a calibration.
#ifndef CIRCLINE_APPS_COMPARE_CAMERA_GUESS_H_
#define CIRCLINE_APPS_COMPARE_CAMERA_GUESS_H_

#include <string>

#include "apps/common/camera_file.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// A camera that looks through the middle of the photo, and how well it is known.
struct GuessedCamera {
  Camera camera;
  CameraSigma sigma;
  std::string words;  // Where its focal length is from, and how sure it is.
};

struct CameraGuess {
  bool wanted = false;       // There is no calibration.
  double fov_deg = 0.0;      // Field of view along the longer side of the photo; 0 = not given.
  double focal_px = 0.0;     // 0 = not given.
  StatedCameraSigma stated;  // How well it is known, where that is stated.
  bool is_exact = false;     // focal_px and fov_deg are, but for what is stated.

  bool IsGiven() const { return fov_deg > 0.0 || focal_px > 0.0; }
  // From what is given, else from the photo's EXIF data, else 60 degrees. A guess is as unknown as
  // UnknownCamera() but for its focal length and what is stated. One that is stated to be known
  // better than to 1 % is a pinhole camera, known as well as a calibrated one (`calibrated`).
  GuessedCamera ForPhoto(const std::string& path, int width, int height,
                         const CameraSigma& calibrated) const;
  // What is stated, and 0 for the rest of what is exact.
  StatedCameraSigma Stated() const;
};

// What there is to say on stderr before the photos are read.
std::string DescribeGuess(const CameraGuess& guess);

// From --fov_deg and --focal_px; not ok: one line that names the flag.
Status CameraGuessFromFlags(CameraGuess* guess);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_CAMERA_GUESS_H_
