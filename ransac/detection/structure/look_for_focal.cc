#include "circline/ransac/detection/structure/look_for_focal.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "circline/ransac/detection/structure/detect_pencils.h"
#include "circline/ransac/detection/structure/straight_lens.h"
#include "circline/ransac/detection/structure/structure_focal.h"

namespace circline {
namespace {

using Eigen::Vector2d;

// What is seen of a photo through a camera whose focal length is a guess.
struct Look {
  double log_focal;  // Of fx.
  PhotoEvidence evidence;
  LikelyFocal likeliest;
};

double LengthOfLines(const PhotoEvidence& evidence) {
  double length = 0.0;
  for (const DetectedLine& line : evidence.lines) length += line.length_px;
  return length;
}

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

// By how much of its distance to the middle such a k1 moves a corner of the photo.
double BendAtCorner(double k1, const Camera& camera) {
  const Vector2d corner(camera.width / camera.fx, camera.height / camera.fy);
  return std::abs(k1) * (0.5 * corner).squaredNorm();
}

// Looks until the photo's lines are straight through the lens that is looked through: one that
// bends breaks them, so each look finds longer ones. Where they do not clearly say so it is the one
// that is known beforehand.
PhotoEvidence LookForLens(const CollectEvidenceFn& collect, const DetectionOptions& options,
                          Camera* camera) {
  constexpr int kMostLooks = 3;
  // Logarithm of how much likelier it is: 20 to 1. Of 3, 6 and 10, on circles-discocal-tir, where
  // 10 leaves three of seven photos as they are, with dots and ChArUco boards beside it.
  constexpr double kClearly = 3.0;
  // Less breaks no lines, and the estimate finds it.
  constexpr double kMatters = 0.05;
  constexpr double kSameK1 = 0.01;
  PhotoEvidence evidence = collect(*camera);
  if (camera->model != CameraModel::kOpenCV || !options.noise_model.camera.IsLensOpen())
    return evidence;
  const double stated_k1 = camera->distortion[0];
  for (int k = 1; k < kMostLooks; ++k) {
    const LikelyLens likeliest = LikeliestLens(evidence, *camera, options.noise_model, stated_k1);
    const double k1 =
        likeliest.gain > kClearly && BendAtCorner(likeliest.k1 - stated_k1, *camera) > kMatters
            ? likeliest.k1
            : stated_k1;
    if (std::abs(k1 - camera->distortion[0]) < kSameK1) break;
    camera->distortion[0] = k1;
    evidence = collect(*camera);
  }
  return evidence;
}

}  // namespace

PhotoEvidence LookForFocal(const CollectEvidenceFn& collect, const DetectionOptions& options,
                           double diagonal_px, Observations* observations) {
  constexpr std::size_t kMostLooks = 4;
  constexpr double kClearly = 0.5;  // Logarithm of how much likelier it is.
  const CameraSigma& sigma = options.noise_model.camera;
  Camera& camera = observations->camera;
  observations->stated_focal_px = camera.fx;
  const double stated_k1 = camera.distortion[0];
  const auto look_through = [&](double log_focal) {
    SetFocal(log_focal - std::log(camera.fx), sigma, &camera);
    observations->found_k1 = camera.distortion[0] - stated_k1;
  };
  double next = OnSteps(FirstLogFocal(camera, sigma));
  std::vector<Look> looks;
  const auto is_next = [&next](const Look& look) {
    return std::abs(look.log_focal - next) < 0.5 * kFocalStep;
  };
  while (looks.size() < kMostLooks && std::none_of(looks.begin(), looks.end(), is_next)) {
    const bool is_first = looks.empty();
    looks.push_back({next, {}, {}});
    Look& look = looks.back();
    look_through(next);
    look.evidence = is_first ? LookForLens(collect, options, &camera) : collect(camera);
    observations->found_k1 = camera.distortion[0] - stated_k1;
    const std::vector<DetectedPencil> pencils =
        DetectPencilsApart(look.evidence.lines, options.max_pencils, options.seed, diagonal_px);
    look.likeliest =
        LikeliestFocal(look.evidence, pencils, camera, sigma, StatedLogFocal(*observations),
                       diagonal_px, observations->found_k1);
    if (look.likeliest.gain > kClearly) next = OnSteps(next + look.likeliest.log_focal);
  }
  // Where the lens is known, but not the focal length, a wrong one bends lines, which break: so
  // little is left of them that it says nothing of others.
  // Of the longest; chessboards at half the focal length have 0.4.
  constexpr double kBroken = 0.75;
  double longest = 0.0;
  for (const Look& look : looks) longest = std::max(longest, LengthOfLines(look.evidence));
  const auto miss = [&](const Look& look) {
    const bool is_broken = LengthOfLines(look.evidence) < kBroken * longest;
    return std::pair(is_broken, look.likeliest.gain);
  };
  const auto best = std::min_element(
      looks.begin(), looks.end(), [&](const Look& a, const Look& b) { return miss(a) < miss(b); });
  look_through(best->log_focal);
  return std::move(best->evidence);
}

}  // namespace circline
