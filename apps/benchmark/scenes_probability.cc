// Whether stated probabilities come true: circle and pencil without outliers, two circles among
// outliers.
#include <cstdio>
#include <string>

#include "apps/benchmark/scenes_bound.h"
#include "apps/benchmark/scenes_experiments.h"
#include "apps/benchmark/scenes_score.h"
#include "apps/benchmark/scenes_settings.h"
#include "apps/common/progress.h"
#include "apps/common/text.h"
#include "circline/estimators/basics.h"

namespace circline::apps {
namespace {

struct Scenes {
  int experiment = 0;  // Of the seeds.
  Recipe recipe;
  Disturbance disturbance;
};

struct Results {
  Tally first;  // Of the first hypothesis.
  Calibration calibration;
  int missing = 0;  // Trials where no hypothesis is right.
};

// Only scenes that the points that count determine within 2 degrees.
Results RunTrials(const ExperimentOptions& options, const Scenes& scenes, LossType loss,
                  int trials) {
  Settings settings;
  settings.loss = loss;
  Results results;
  Progress progress("scenes", trials);
  for (int trial = 0; trial < trials; ++trial) {
    Random random = options.TrialRandom(scenes.experiment, trial);
    World world;
    Observations observations;
    Bound bound;
    do {
      world = DrawWorld(scenes.recipe, &random);
      Masks masks;
      observations = Observe(world, scenes.disturbance, &random, &masks);
      BoundRequest request;
      request.noise_px = scenes.disturbance.noise_px;
      request.masks = &masks;
      bound = ComputeBound(world, request);
    } while (!bound.finite || bound.rotation_rad > 2.0 * kDegree ||
             SmallestSemiMinorPx(world) < 20.0 * scenes.disturbance.noise_px);
    const PoseEstimate estimate = Estimate(settings, observations);
    progress.Advance();
    PoseError nearest;
    if (Nearest(world.pose.rotation, bound.spin_is_free, estimate, &nearest) == nullptr) {
      results.first.AddRefused();
      continue;
    }
    const PoseHypothesis& first = estimate.hypotheses.front();
    const PoseError error = ComparePose(world.pose.rotation, bound.spin_is_free, first);
    results.first.Add(error, bound);
    results.calibration.Add(first.probability, !IsWrong(error, bound));
    results.missing += IsWrong(nearest, bound) ? 1 : 0;
  }
  progress.Clear();
  return results;
}

void PrintHeader() {
  std::printf(
      "  loss           noise            wrong  expected  allowed  at p>=.99  (n)    at p>=.9999  "
      "(n)    missing  %s\n",
      Tally::Header().c_str());
}

void PrintRow(const Scenes& scenes, LossType loss, const Results& results) {
  const Calibration& c = results.calibration;
  const Disturbance& d = scenes.disturbance;
  std::printf("  %-13s  %-4s %-11s  %4.0f  %8s  %7s  %9d  %5d  %11d  %5d  %7d  %s\n",
              LossName(loss), FormatPlain(d.noise_px).c_str(), d.stated ? "stated" : "not stated",
              c.NumWrong(), FormatFixed(c.NumExpected(), 1).c_str(),
              FormatFixed(c.NumAllowed(), 1).c_str(), c.NumWrongAbove(0.99), c.NumAbove(0.99),
              c.NumWrongAbove(0.9999), c.NumAbove(0.9999), results.missing,
              results.first.Row().c_str());
}

Recipe CirclesOnly(int count) {
  Recipe recipe;
  recipe.min_circles = recipe.max_circles = count;
  recipe.max_pencils = 0;
  recipe.ring_share = 0.0;
  recipe.min_arc_deg = 180.0;
  recipe.min_tilt_deg = 15.0;
  recipe.max_tilt_deg = 75.0;
  recipe.min_points = 30;
  return recipe;
}

}  // namespace

void RunOutliers(const ExperimentOptions& options) {
  const int trials = options.Trials(200);
  Scenes scenes;
  scenes.experiment = 6;
  scenes.recipe = CirclesOnly(2);
  scenes.disturbance.outlier_ratio = 0.4;
  std::printf("Two coplanar circles, 40 %% outliers within 40 px; of the first hypothesis\n");
  PrintHeader();
  for (const LossType loss : options.Losses({LossType::kCauchy, LossType::kTukey})) {
    for (const double noise : options.Noises({0.5, 1.0})) {
      for (const bool stated : {true, false}) {
        scenes.disturbance.noise_px = noise;
        scenes.disturbance.stated = stated;
        PrintRow(scenes, loss, RunTrials(options, scenes, loss, trials));
      }
    }
  }
  std::printf("\n");
}

void RunCircleAndPencil(const ExperimentOptions& options) {
  const int trials = options.Trials(300);
  Scenes scenes;
  scenes.experiment = 7;
  scenes.recipe.min_circles = scenes.recipe.max_circles = 1;
  scenes.recipe.min_pencils = scenes.recipe.max_pencils = 1;
  scenes.recipe.free_pencils = false;
  scenes.recipe.min_arc_deg = 180.0;
  std::printf("Circle and pencil, no outliers; of the first hypothesis\n");
  PrintHeader();
  for (const LossType loss : options.Losses({LossType::kTrivial, LossType::kCauchy})) {
    for (const double noise : options.Noises({0.5, 2.0})) {
      for (const bool stated : {true, false}) {
        scenes.disturbance.noise_px = noise;
        scenes.disturbance.stated = stated;
        PrintRow(scenes, loss, RunTrials(options, scenes, loss, trials));
      }
    }
  }
  std::printf("\n");
}

}  // namespace circline::apps
