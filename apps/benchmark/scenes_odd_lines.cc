// A front end's own lines, some of which have another direction than their pencil: the scene of
// docs/example.cc (a rim of known radius and five kerbs), and a circle with two pencils of ten.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "apps/benchmark/scenes_bound.h"
#include "apps/benchmark/scenes_experiments.h"
#include "apps/benchmark/scenes_score.h"
#include "apps/benchmark/scenes_settings.h"
#include "apps/common/progress.h"
#include "apps/common/text.h"
#include "circline/estimators/basics.h"

namespace circline::apps {
namespace {

constexpr double kLeastMiss = 10.0;  // Standard deviations by which an odd line is off.

struct Case {
  const char* name;
  int pencils, lines, odd;  // Lines and odd lines of each pencil.
};
constexpr Case kCases[] = {{"rim, 5 kerbs, 0 odd", 1, 5, 0},
                           {"rim, 5 kerbs, 1 odd", 1, 5, 1},
                           {"rim, 5 kerbs, 2 odd", 1, 5, 2},
                           {"circle, 2 x 10 lines, 10 %", 2, 10, 1},
                           {"circle, 2 x 10 lines, 30 %", 2, 10, 3}};

Recipe RecipeOf(const Case& c) {
  Recipe recipe;
  recipe.num_lenses = 2;
  recipe.min_circles = recipe.max_circles = 1;
  recipe.min_pencils = recipe.max_pencils = c.pencils;
  recipe.min_lines = recipe.max_lines = c.lines;
  recipe.pencils_only_too = recipe.free_pencils = false;
  recipe.partial_share = 0.0;
  recipe.min_tilt_deg = 15.0;
  recipe.max_tilt_deg = 75.0;
  recipe.min_points = 50;
  recipe.max_points = 200;
  recipe.max_line_points = 2;
  return recipe;
}

// The first lines of each pencil turn until they are far enough off. False where they cannot.
bool TurnOddLines(const Case& c, double noise_px, World* world, Random* random) {
  for (WorldPencil& pencil : world->pencils) {
    for (int i = 0; i < c.odd; ++i) {
      WorldLine& line = pencil.lines[static_cast<std::size_t>(i)];
      const double turn = 2.0 * std::pow(45.0, random->Uniform()) * kDegree;
      line.turn = random->Uniform() < 0.5 ? -turn : turn;
      if (!(OddLineMiss(*world, pencil, line) >= kLeastMiss * noise_px)) return false;
    }
  }
  return true;
}

World DrawCase(const Case& c, double noise_px, Bound* bound, Random* random) {
  while (true) {
    World world = DrawWorld(RecipeOf(c), random);
    if (c.pencils == 1) world.circles[0].stated_radius = 1.0;
    if (!TurnOddLines(c, noise_px, &world, random) || !IsVisible(world)) continue;
    if (SmallestSemiMinorPx(world) < 20.0 * noise_px) continue;
    BoundRequest request;
    request.noise_px = noise_px;
    *bound = ComputeBound(world, request);
    if (bound->finite && bound->rotation_rad <= 2.0 * kDegree) return world;
  }
}

struct Counts {
  int wrong = 0, wrong_and_sure = 0, refused = 0, missing = 0;
  int wrong_anyway = 0;  // Without the odd lines, too: the rest leaves two poses, noise decides.
};

Observations WithoutOddLines(const Case& c, Observations observations) {
  for (PencilObservation& pencil : observations.pencils)
    pencil.lines.erase(pencil.lines.begin(), pencil.lines.begin() + c.odd);
  return observations;
}

bool IsFirstWrong(const World& world, const Bound& bound, const PoseEstimate& estimate) {
  if (!estimate.status.ok()) return false;
  return IsWrong(ComparePose(world.pose.rotation, false, estimate.hypotheses.front()), bound);
}

}  // namespace

void RunOddLines(const ExperimentOptions& options) {
  constexpr double kSure = 0.95;
  const int trials = options.Trials(80);
  const std::vector<LossType> losses =
      options.Losses({LossType::kTrivial, LossType::kHuber, LossType::kCauchy, LossType::kTukey,
                      LossType::kGemanMcClure});
  for (const double noise : options.Noises({0.5})) {
    std::printf(
        "Lines of another direction, >= 10 sigma off, noise %s px; of the first hypothesis: "
        "wrong%% "
        "(wrong without the odd lines, too; wrong at p >= 0.95; truth missing); n = %d\n",
        FormatPlain(noise).c_str(), trials);
    std::printf("  %-27s %-10s", "scene", "noise");
    for (const LossType loss : losses) std::printf("  %-16s", LossName(loss));
    std::printf("\n");
    for (const Case& c : kCases) {
      std::vector<std::vector<Counts>> counts(2, std::vector<Counts>(losses.size()));
      Progress progress("scenes with odd lines", trials);
      for (int trial = 0; trial < trials; ++trial) {
        Random random = options.TrialRandom(8, trial);
        Bound bound;
        const World world = DrawCase(c, noise, &bound, &random);
        for (const bool stated : {true, false}) {
          Random noise_random = random;
          const Observations observations = Observe(world, {noise, stated}, &noise_random);
          for (std::size_t i = 0; i < losses.size(); ++i) {
            Settings settings;
            settings.loss = losses[i];
            const PoseEstimate estimate = Estimate(settings, observations);
            Counts& count = counts[stated ? 0 : 1][i];
            PoseError nearest;
            if (Nearest(world.pose.rotation, false, estimate, &nearest) == nullptr) {
              ++count.refused;
              continue;
            }
            const PoseHypothesis& first = estimate.hypotheses.front();
            const bool wrong = IsFirstWrong(world, bound, estimate);
            count.wrong += wrong ? 1 : 0;
            if (wrong) {
              const PoseEstimate rest = Estimate(settings, WithoutOddLines(c, observations));
              count.wrong_anyway += IsFirstWrong(world, bound, rest) ? 1 : 0;
            }
            count.wrong_and_sure += wrong && first.probability >= kSure ? 1 : 0;
            count.missing += IsWrong(nearest, bound) ? 1 : 0;
          }
        }
        progress.Advance();
      }
      progress.Clear();
      for (const bool stated : {true, false}) {
        std::printf("  %-27s %-10s", c.name, stated ? "stated" : "not stated");
        for (const Counts& count : counts[stated ? 0 : 1]) {
          std::string cell = FormatFixed(100.0 * count.wrong / trials, 1) + " (" +
                             std::to_string(count.wrong_anyway) + ", " +
                             std::to_string(count.wrong_and_sure) + ", " +
                             std::to_string(count.missing) + ")";
          if (count.refused > 0) cell += " -" + std::to_string(count.refused);
          std::printf("  %-16s", cell.c_str());
        }
        std::printf("\n");
      }
    }
    std::printf("  (-n: refused)\n\n");
  }
}

}  // namespace circline::apps
