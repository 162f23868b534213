// The experiments of circline_scenes_benchmark. Each prints one table.
#ifndef CIRCLINE_APPS_BENCHMARK_SCENES_EXPERIMENTS_H_
#define CIRCLINE_APPS_BENCHMARK_SCENES_EXPERIMENTS_H_

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "apps/benchmark/scenes_bound.h"
#include "apps/benchmark/scenes_world.h"
#include "circline/estimators/random.h"
#include "circline/estimators/robust_loss.h"

namespace circline::apps {

struct ExperimentOptions {
  int trials = 0;                // Of each row; 0: the experiment's own.
  std::uint64_t seed = 1;        // Of the scenes and their noise.
  std::vector<double> noise_px;  // Empty: the experiment's own.
  std::vector<LossType> losses;  // Empty: the experiment's own.

  int Trials(int own) const { return trials > 0 ? trials : own; }
  std::vector<double> Noises(const std::vector<double>& own) const {
    return noise_px.empty() ? own : noise_px;
  }
  std::vector<LossType> Losses(const std::vector<LossType>& own) const {
    return losses.empty() ? own : losses;
  }
  // The same trial of all rows of an experiment has the same scene.
  Random TrialRandom(int experiment, int trial) const {
    return Random(1000003 * seed + 10007 * static_cast<std::uint64_t>(experiment) * 1000 +
                  static_cast<std::uint64_t>(trial));
  }
};

// A scene to estimate, and what is true of it.
struct Scene {
  std::string kind;  // Which line of its row it counts in, where there are several.
  World world;
  Disturbance disturbance;
  double focal_factor = 1.0;     // The focal length that is given over the true one.
  BoundRequest request;          // Of what agrees.
  Bound bound;                   // By this request.
  std::vector<std::string> odd;  // Features that contradict the rest: "c1", "L0[2]".
};

struct SceneRow {
  std::string name;
  std::function<Scene(double noise_px, Random* random)> draw;
};

struct SceneExperiment {
  std::string name, title;
  int number = 0;  // Of its seeds.
  int trials = 0;
  std::vector<double> noise_px;
  std::vector<LossType> losses;
  std::vector<SceneRow> rows;
  bool as_photographed = false;  // The noise model of photographs; else of points alone.
};

std::vector<SceneExperiment> SceneExperiments();
void RunScenes(const SceneExperiment& experiment, const ExperimentOptions& options);

// Sequences of frames of a moving camera.
void RunTracking(const ExperimentOptions& options);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_BENCHMARK_SCENES_EXPERIMENTS_H_
