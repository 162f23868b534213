// A focal length that is off by up to 60 %, with a prior that allows for it.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>

#include "apps/benchmark/scenes_bound.h"
#include "apps/benchmark/scenes_experiments.h"
#include "apps/benchmark/scenes_score.h"
#include "apps/benchmark/scenes_settings.h"
#include "apps/common/progress.h"
#include "apps/common/text.h"

namespace circline::apps {
namespace {

constexpr double kLogFocalSigma = 0.5;
constexpr double kLargestBound = 0.1;  // Of log f, standard deviations.

enum class Content { kRings, kCoplanar, kCircleAndPencils };
const char* ContentName(Content content) {
  switch (content) {
    case Content::kRings:
      return "rings";
    case Content::kCoplanar:
      return "coplanar circles";
    case Content::kCircleAndPencils:
      return "circle + pencils";
  }
  return "";
}

Recipe RecipeOf(Content content) {
  Recipe recipe;
  recipe.num_lenses = 2;
  recipe.pencils_only_too = recipe.free_pencils = false;
  recipe.partial_share = 0.0;
  recipe.min_tilt_deg = 15.0;
  recipe.max_tilt_deg = 75.0;
  recipe.min_points = 50;
  recipe.max_pencils = 0;
  recipe.ring_share = content == Content::kRings ? 1.0 : 0.0;
  recipe.min_circles = 2;
  recipe.max_circles = content == Content::kRings ? 3 : 5;
  if (content == Content::kCircleAndPencils) {
    recipe.min_circles = recipe.max_circles = 1;
    recipe.min_pencils = 1;
    recipe.max_pencils = 2;
    recipe.min_lines = 3;
  }
  return recipe;
}

World DrawKnownFocal(Content content, double noise_px, Bound* bound, Random* random) {
  BoundRequest request;
  request.noise_px = noise_px;
  request.log_focal_sigma = kLogFocalSigma;
  while (true) {
    World world = DrawWorld(RecipeOf(content), random);
    if (SmallestSemiMinorPx(world) < 20.0 * noise_px) continue;
    *bound = ComputeBound(world, request);
    if (bound->finite && bound->log_focal <= kLargestBound) return world;
  }
}

struct FocalTally {
  int count = 0, covered = 0, at_prior = 0;
  double nees = 0.0, squared_ratio = 0.0;
};

void AddFocal(const PoseHypothesis& h, double true_scale, const Bound& bound, FocalTally* tally) {
  const double error = h.focal_scale - true_scale;
  ++tally->count;
  const double log_error = std::log(h.focal_scale / true_scale) / bound.log_focal;
  tally->squared_ratio += log_error * log_error;
  tally->nees += error * error / (h.focal_sigma * h.focal_sigma);
  tally->covered += std::abs(error) <= 2.0 * h.focal_sigma ? 1 : 0;
}

void RunRow(const ExperimentOptions& options, Content content, double off, double noise,
            LossType loss) {
  const int trials = options.Trials(15);
  Settings settings;
  settings.loss = loss;
  settings.log_focal_sigma = kLogFocalSigma;
  Tally pose;
  FocalTally focal;
  Progress progress("scenes of unknown focal length", 2 * trials);
  for (int trial = 0; trial < trials; ++trial) {
    for (const bool too_long : {true, false}) {
      Random random = options.TrialRandom(5, trial);
      Bound bound;
      const World world = DrawKnownFocal(content, noise, &bound, &random);
      Observations observations = Observe(world, {noise, true}, &random);
      const double factor = too_long ? 1.0 + off : 1.0 / (1.0 + off);
      observations.camera.fx *= factor;
      observations.camera.fy *= factor;
      const PoseEstimate estimate = Estimate(settings, observations);
      progress.Advance();
      PoseError error;
      const PoseHypothesis* nearest =
          Nearest(world.pose.rotation, bound.spin_is_free, estimate, &error);
      if (nearest == nullptr) {
        pose.AddRefused();
        continue;
      }
      pose.Add(error, bound);
      AddFocal(*nearest, 1.0 / factor, bound, &focal);
    }
  }
  progress.Clear();
  const int n = std::max(1, focal.count);
  std::printf("  %-17s %3.0f %%  %8s  %6s  %10s  %s\n", ContentName(content), 100.0 * off,
              FormatFixed(std::sqrt(focal.squared_ratio / n), 2).c_str(),
              FormatFixed(100.0 * focal.covered / n, 1).c_str(),
              FormatShort(focal.nees / n).c_str(), pose.Row().c_str());
}

}  // namespace

void RunFocalLength(const ExperimentOptions& options) {
  for (const LossType loss : options.Losses({LossType::kCauchy})) {
    for (const double noise : options.Noises({0.5})) {
      std::printf(
          "Focal length off (longer and shorter), prior 0.5 of log f, bound on it <= 0.1, noise %s "
          "px stated, loss %s; hypothesis nearest the truth\n",
          FormatPlain(noise).c_str(), LossName(loss));
      std::printf("  scene             off    f: rms/b  cover%%        NEES  %s\n",
                  Tally::Header().c_str());
      for (const Content content :
           {Content::kRings, Content::kCoplanar, Content::kCircleAndPencils}) {
        for (const double off : {0.1, 0.3, 0.6}) RunRow(options, content, off, noise, loss);
      }
      std::printf("\n");
    }
  }
}

}  // namespace circline::apps
