#include "apps/calibrate/calibration_pictures.h"

#include <algorithm>

#include "apps/common/in_parallel.h"
#include "apps/compare/encode.h"
#include "apps/compare/image_run.h"
#include "apps/compare/overlay.h"

namespace circline::apps {
namespace {

// Photos to show, left-out ones first, the others evenly spread.
std::vector<std::size_t> ChoosePhotos(const AdjustedPhotos& adjusted) {
  constexpr std::size_t kMost = 24;
  std::vector<std::size_t> chosen, others;
  for (std::size_t i = 0; i < adjusted.photos.size(); ++i)
    (adjusted.photos[i].status.ok() ? others : chosen).push_back(i);
  chosen.resize(std::min(chosen.size(), kMost / 2));
  const std::size_t step = 1 + others.size() / (kMost - chosen.size() + 1);
  for (std::size_t k = 0; k < others.size(); k += step) chosen.push_back(others[k]);
  return chosen;
}

}  // namespace

std::vector<std::string> CalibrationPictures(const CompareOptions& options,
                                             const AdjustedPhotos& adjusted,
                                             const std::vector<SceneImage>& images) {
  constexpr int kWidth = 720;  // Pixels.
  CompareOptions joint = options;
  joint.solvers = {"joint"};
  joint.overlays = true;
  joint.inputs.guess = CameraGuess();
  // Seen through the camera that was estimated, whatever was known of it before.
  joint.closed_form.noise_model.camera = CameraSigma();
  for (LossSetting& loss : joint.losses)
    loss.estimation.camera_sigma = loss.estimation.noise_model.camera = CameraSigma();
  const SolverSet solvers(joint);
  const std::vector<std::size_t> chosen = ChoosePhotos(adjusted);
  std::vector<std::string> pictures(images.size());
  InParallel(static_cast<int>(chosen.size()), [&](int k) {
    const std::size_t i = chosen[static_cast<std::size_t>(k)];
    SceneImage image = images[i];
    const AdjustedCamera& made =
        adjusted.cameras[static_cast<std::size_t>(adjusted.photos[i].camera)];
    image.observations.camera = made.camera;
    image.camera_sigma = StatedCameraSigma();
    image.guessed_sigma.reset();
    const ImageRun run = RunImage(joint, &solvers, &image);
    if (!run.photo.empty()) pictures[i] = EncodeJpeg(DrawOverlay(run), kWidth);
  });
  return pictures;
}

}  // namespace circline::apps
