#include "circline/estimators/aspect_sigma.h"

#include <algorithm>
#include <cmath>

namespace circline {

CameraSigma SigmaOf(const CameraSigma& sigma, const Camera& camera) {
  constexpr double kOfAnalogueVideo = 0.02;
  CameraSigma of_camera = sigma;
  if (sigma.log_aspect > 0.0) {
    const double found = std::abs(std::log(camera.fy / camera.fx));
    of_camera.log_aspect = std::max(sigma.log_aspect, std::min(found, kOfAnalogueVideo));
  }
  return of_camera;
}

}  // namespace circline
