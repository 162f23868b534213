// Circles that are hard to place, or are not what they are said to be: short arcs, one circle
// off the others' plane or of a wrong radius, discs whose print bleeds.
#include <Eigen/Dense>
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
#include "circline/estimators/basics.h"

namespace circline::apps {
namespace {

std::string Percent(int part, int whole) {
  return FormatFixed(100.0 * part / std::max(1, whole), 1);
}

// Whole coplanar circles, no ring among them.
Recipe WholeCircles(int count) {
  Recipe recipe;
  recipe.min_circles = recipe.max_circles = count;
  recipe.max_pencils = 0;
  recipe.ring_share = recipe.partial_share = 0.0;
  recipe.min_tilt_deg = 15.0;
  recipe.max_tilt_deg = 75.0;
  recipe.min_points = 50;
  recipe.max_points = 200;
  return recipe;
}

struct ShortArcRow {
  int trials = 0, refused = 0, gross = 0, sure = 0, gross_and_sure = 0, gross_nearest = 0;
};

void PrintShortArcs(double noise, bool stated, const ShortArcRow& row, const Tally& tally) {
  std::printf("  %-4s %-11s  %6s  %7s  %8s  %14s  %s\n", FormatPlain(noise).c_str(),
              stated ? "stated" : "not stated", Percent(row.gross, row.trials).c_str(),
              Percent(row.gross_nearest, row.trials).c_str(), Percent(row.sure, row.trials).c_str(),
              Percent(row.gross_and_sure, row.trials).c_str(), tally.Row().c_str());
}

// Twelve equal discs on a lattice.
World DrawDiscs(Random* random) {
  while (true) {
    World world = DrawWorld(WholeCircles(1), random);
    const WorldCircle disc = world.circles[0];
    world.circles.clear();
    const double pitch = 1.4 * disc.radius;
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 4; ++column) {
        WorldCircle c = disc;
        c.radius = 0.35 * pitch;
        c.center = pitch * Eigen::Vector2d(column - 1.5, row - 1.0);
        world.circles.push_back(c);
      }
    }
    world.equal_radii = true;
    if (IsVisible(world) && SmallestSemiMinorPx(world) > 10.0) return world;
  }
}

}  // namespace

void RunShortArcs(const ExperimentOptions& options) {
  constexpr double kGross = 20.0 * kDegree, kSure = 0.99;
  const int trials = options.Trials(200);
  const std::vector<double> noises = options.Noises({0.5, 1.0});
  for (const LossType loss : options.Losses({LossType::kCauchy})) {
    Settings settings;
    settings.loss = loss;
    std::printf("Three whole circles and an arc of 45-60 deg, loss %s (gross: > 20 deg)\n",
                LossName(loss));
    std::printf("  noise             gross%%  nearest  p>=0.99%%  gross and sure%%  %s\n",
                Tally::Header().c_str());
    for (const double noise : noises) {
      for (const bool stated : {true, false}) {
        ShortArcRow row;
        Tally tally;
        Progress progress("short arcs", trials);
        for (int trial = 0; trial < trials; ++trial) {
          Random random = options.TrialRandom(2, trial);
          World world = DrawWorld(WholeCircles(4), &random);
          world.circles[3].arc = random.Uniform(45.0, 60.0) * kDegree;
          const Disturbance disturbance{noise, stated};
          BoundRequest request;
          request.noise_px = noise;
          const Bound bound = ComputeBound(world, request);
          const PoseEstimate estimate = Estimate(settings, Observe(world, disturbance, &random));
          progress.Advance();
          ++row.trials;
          if (!estimate.status.ok()) {
            tally.AddRefused();
            continue;
          }
          const PoseHypothesis& first = estimate.hypotheses.front();
          const PoseError error = ComparePose(world.pose.rotation, true, first);
          PoseError nearest;
          Nearest(world.pose.rotation, true, estimate, &nearest);
          tally.Add(nearest, bound);
          const bool gross = error.angle > kGross, sure = first.probability >= kSure;
          row.gross += gross ? 1 : 0;
          row.sure += sure ? 1 : 0;
          row.gross_and_sure += gross && sure ? 1 : 0;
          row.gross_nearest += nearest.angle > kGross ? 1 : 0;
        }
        progress.Clear();
        PrintShortArcs(noise, stated, row, tally);
      }
    }
    std::printf("\n");
  }
}

void RunBleed(const ExperimentOptions& options) {
  const int trials = options.Trials(100);
  const std::vector<double> noises = options.Noises({0.2});
  for (const LossType loss : options.Losses({LossType::kCauchy})) {
    Settings settings;
    settings.loss = loss;
    settings.exact = false;  // As on photographs.
    std::printf("Twelve equal discs, all too large, noise model of photographs, loss %s\n",
                LossName(loss));
    std::printf("  noise             bleed  %s\n", Tally::Header().c_str());
    for (const double noise : noises) {
      for (const bool stated : {true, false}) {
        for (const double bleed : {0.0, 0.2, 0.3}) {
          Tally tally;
          Progress progress("discs", trials);
          for (int trial = 0; trial < trials; ++trial) {
            Random random = options.TrialRandom(4, trial);
            const World world = DrawDiscs(&random);
            BoundRequest request;
            request.noise_px = noise;
            const Bound bound = ComputeBound(world, request);
            const PoseEstimate estimate =
                Estimate(settings, Observe(world, {noise, stated, bleed}, &random));
            progress.Advance();
            PoseError nearest;
            if (Nearest(world.pose.rotation, true, estimate, &nearest) != nullptr) {
              tally.Add(nearest, bound);
            } else {
              tally.AddRefused();
            }
          }
          progress.Clear();
          std::printf("  %-4s %-11s  %-5s  %s\n", FormatPlain(noise).c_str(),
                      stated ? "stated" : "not stated", FormatPlain(bleed).c_str(),
                      tally.Row().c_str());
        }
      }
    }
    std::printf("\n");
  }
}

}  // namespace circline::apps
