// The experiments of circline_scenes_benchmark. Each prints one table.
#ifndef CIRCLINE_APPS_BENCHMARK_SCENES_EXPERIMENTS_H_
#define CIRCLINE_APPS_BENCHMARK_SCENES_EXPERIMENTS_H_

#include <cstdint>
#include <vector>

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

// Scenes of every kind, by noise: errors against the bound, coverage, probabilities.
void RunRandomScenes(const ExperimentOptions& options);
// Three full circles and one short arc, all coplanar.
void RunShortArcs(const ExperimentOptions& options);
// One of the circles has a plane of its own, or a wrong radius.
void RunOddCircles(const ExperimentOptions& options);
// Twelve equal discs whose print bleeds.
void RunBleed(const ExperimentOptions& options);
// A focal length that is not known well.
void RunFocalLength(const ExperimentOptions& options);
// Two circles among outliers.
void RunOutliers(const ExperimentOptions& options);
// Circle and pencil without outliers: do probabilities come true?
void RunCircleAndPencil(const ExperimentOptions& options);
// Circle and pencils, some of whose lines have another direction.
void RunOddLines(const ExperimentOptions& options);
// Sequences of frames of a moving camera.
void RunTracking(const ExperimentOptions& options);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_BENCHMARK_SCENES_EXPERIMENTS_H_
