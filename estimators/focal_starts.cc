#include "circline/estimators/focal_starts.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "circline/estimators/focal_evidence.h"

namespace circline {
namespace {

// The start of the same evidence that is nearest; null where there is none.
const FocalStart* Nearest(const FocalStart& start, const std::vector<FocalStart>& others) {
  const FocalStart* nearest = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (const FocalStart& other : others) {
    const double apart = std::abs(std::log(other.focal_px / start.focal_px));
    if (other.evidence == start.evidence && apart < least) nearest = &other, least = apart;
  }
  return nearest;
}

// Points are undistorted with the guess: what its error does to the starts, by fits with the
// focal length a little longer and shorter.
void AddErrorOfGuess(const Observations& observations, double sigma_px, const NoiseModel& noise,
                     std::vector<FocalStart>* starts) {
  constexpr double kStep = 0.05;  // Of log focal length.
  std::array<std::vector<FocalStart>, 2> moved;
  for (std::size_t side = 0; side < 2; ++side) {
    Observations refitted = observations;
    const double factor = std::exp(side == 0 ? kStep : -kStep);
    refitted.camera.fx *= factor;
    refitted.camera.fy *= factor;
    ResetFits(&refitted);
    FitDirect(sigma_px, &refitted, nullptr, noise);
    moved[side] = FocalStartsOfFits(refitted, sigma_px, noise, nullptr);
  }
  for (FocalStart& start : *starts) {
    const FocalStart *up = Nearest(start, moved[0]), *down = Nearest(start, moved[1]);
    // A start that does not survive is no surer than the guess.
    const double slope = up != nullptr && down != nullptr
                             ? std::log(up->focal_px / down->focal_px) / (2.0 * kStep)
                             : 1.0;
    start.sigma_log = std::hypot(start.sigma_log, slope * noise.camera.log_focal);
  }
}

// The surest first, without those that agree with a surer one.
std::vector<FocalStart> Distinct(std::vector<FocalStart> starts) {
  std::stable_sort(starts.begin(), starts.end(), [](const FocalStart& a, const FocalStart& b) {
    return a.sigma_log < b.sigma_log;
  });
  std::vector<FocalStart> distinct;
  for (const FocalStart& start : starts) {
    const bool is_new = std::none_of(distinct.begin(), distinct.end(), [&](const FocalStart& d) {
      return std::abs(std::log(d.focal_px / start.focal_px)) <=
             std::hypot(d.sigma_log, start.sigma_log);
    });
    if (is_new) distinct.push_back(start);
  }
  return distinct;
}

bool IsDistorted(const Camera& camera) {
  return camera.model == CameraModel::kFisheye ||
         (camera.model == CameraModel::kOpenCV &&
          std::any_of(camera.distortion.begin(), camera.distortion.end(),
                      [](double k) { return k != 0.0; }));
}

}  // namespace

std::vector<FocalStart> FocalLengthStarts(const Observations& observations, double default_sigma_px,
                                          const NoiseModel& noise,
                                          std::vector<std::string>* problems) {
  const Status camera = observations.camera.Validate();
  if (!camera.ok()) {
    if (problems != nullptr) problems->push_back("focal length: " + camera.message);
    return {};
  }
  std::vector<FocalStart> starts =
      FocalStartsOfFits(observations, default_sigma_px, noise, problems);
  const bool is_bent_by_guess = IsDistorted(observations.camera) && !noise.camera.IsLensOpen();
  if (noise.camera.log_focal > 0.0 && is_bent_by_guess) {
    AddErrorOfGuess(observations, default_sigma_px, noise, &starts);
  }
  return Distinct(std::move(starts));
}

}  // namespace circline
