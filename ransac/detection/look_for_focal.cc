#include "circline/ransac/detection/look_for_focal.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "circline/ransac/detection/detect_pencils.h"
#include "circline/ransac/detection/structure_focal.h"

namespace circline {
namespace {

// What is seen of a photo through a camera whose focal length is a guess.
struct Look {
  double log_focal;  // Of fx.
  PhotoEvidence evidence;
  LikelyFocal likeliest;
};

// The same focal lengths whatever the guess.
double OnSteps(double log_focal) { return kFocalStep * std::round(log_focal / kFocalStep); }

// Of a usual lens, or as near to it as what is known of the focal length lets it be: what the photo
// shows does not depend on who guesses.
double FirstLogFocal(const Camera& camera, const CameraSigma& sigma) {
  constexpr double kUsual = 0.8660254;  // Over the longer side of the photo: 60 degrees.
  const double stated = std::log(camera.fx);
  const int longer = std::max(camera.width, camera.height);
  if (longer == 0) return stated;
  return std::clamp(std::log(kUsual * longer), stated - sigma.log_focal, stated + sigma.log_focal);
}

void SetLogFocal(double log_focal, Camera* camera) {
  const double factor = std::exp(log_focal) / camera->fx;
  camera->fx *= factor;
  camera->fy *= factor;
}

Status LookAt(const CollectEvidenceFn& collect, const Camera& camera, double stated,
              const DetectionOptions& options, double diagonal_px, Look* look) {
  Status status = collect(camera, &look->evidence);
  std::vector<DetectedPencil> pencils;
  if (status.ok() && options.max_pencils > 0) {
    status = DetectPencilsApart(look->evidence.lines, options.max_pencils, options.seed, &pencils,
                                diagonal_px);
  }
  if (!status.ok()) return status;
  look->likeliest = LikeliestFocal(look->evidence, pencils, camera, options.noise_model.camera,
                                   stated - look->log_focal, diagonal_px);
  return Status::Ok();
}

}  // namespace

Status LookForFocal(const CollectEvidenceFn& collect, const DetectionOptions& options,
                    double diagonal_px, PhotoEvidence* evidence, Observations* observations) {
  constexpr std::size_t kMostLooks = 4;
  constexpr double kClearly = 0.5;  // Logarithm of how much likelier it is.
  Camera& camera = observations->camera;
  observations->stated_focal_px = camera.fx;
  const double stated = std::log(camera.fx);
  double next = OnSteps(FirstLogFocal(camera, options.noise_model.camera));
  std::vector<Look> looks;
  const auto is_next = [&next](const Look& look) {
    return std::abs(look.log_focal - next) < 0.5 * kFocalStep;
  };
  while (looks.size() < kMostLooks && std::none_of(looks.begin(), looks.end(), is_next)) {
    looks.push_back({next, {}, {}});
    SetLogFocal(next, &camera);
    const Status status = LookAt(collect, camera, stated, options, diagonal_px, &looks.back());
    if (!status.ok()) return status;
    const LikelyFocal& likeliest = looks.back().likeliest;
    if (likeliest.gain > kClearly) next = OnSteps(next + likeliest.log_focal);
  }
  const auto best = std::min_element(looks.begin(), looks.end(), [](const Look& a, const Look& b) {
    return a.likeliest.gain < b.likeliest.gain;
  });
  SetLogFocal(best->log_focal, &camera);
  *evidence = std::move(best->evidence);
  return Status::Ok();
}

}  // namespace circline
