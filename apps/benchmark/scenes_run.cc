#include <cstdio>
#include <map>

#include "apps/benchmark/scenes_experiments.h"
#include "apps/benchmark/scenes_score.h"
#include "apps/common/progress.h"
#include "apps/common/text.h"
#include "circline/estimators/noise_model.h"
#include "circline/ransac/fit_observations.h"
#include "circline/refine/estimate_pose.h"

namespace circline::apps {
namespace {

PoseEstimate Estimate(const Scene& scene, LossType loss, bool as_photographed,
                      Observations observations) {
  FitOptions fit;
  EstimationOptions options;
  if (!as_photographed) fit.noise_model = options.noise_model = NoiseModel::Exact();
  options.conic_loss.type = options.line_loss.type = loss;
  if (scene.request.log_focal_sigma > 0.0) {
    options.camera_sigma = options.noise_model.camera;
    options.camera_sigma->log_focal = scene.request.log_focal_sigma;
    fit.noise_model.camera = *options.camera_sigma;
  }
  observations.camera.fx *= scene.focal_factor;
  observations.camera.fy *= scene.focal_factor;
  PoseEstimate estimate;
  estimate.status = FitObservations(fit, &observations);
  return estimate.status.ok() ? EstimatePose(observations, options) : estimate;
}

}  // namespace

void RunScenes(const SceneExperiment& experiment, const ExperimentOptions& options) {
  const int trials = options.Trials(experiment.trials);
  std::printf("%s: %s\n  %-14s %-5s %-11s %-32s %s\n", experiment.name.c_str(),
              experiment.title.c_str(), "loss", "noise", "", "", Tally::Header().c_str());
  for (const LossType loss : options.Losses(experiment.losses)) {
    for (const SceneRow& row : experiment.rows) {
      for (const double noise : options.Noises(experiment.noise_px)) {
        for (const bool is_stated : {true, false}) {
          std::map<std::string, Tally> tallies;
          Progress progress(experiment.name, trials);
          for (int trial = 0; trial < trials; ++trial) {
            Random random = options.TrialRandom(experiment.number, trial);
            Scene scene = row.draw(noise, &random);
            scene.disturbance.noise_px = noise;
            scene.disturbance.stated = is_stated;
            tallies[row.name + scene.kind].Add(
                scene, Estimate(scene, loss, experiment.as_photographed,
                                Observe(scene.world, scene.disturbance, &random)));
            progress.Advance();
          }
          progress.Clear();
          for (const auto& [name, tally] : tallies) {
            std::printf("  %-14s %-5s %-11s %-32s %s\n", LossName(loss), FormatPlain(noise).c_str(),
                        is_stated ? "stated" : "not stated", name.c_str(), tally.Row().c_str());
          }
        }
      }
    }
  }
  std::printf("\n");
}

}  // namespace circline::apps
