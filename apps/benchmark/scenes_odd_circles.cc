// One circle contradicts the others: its plane is tilted, or its stated radius is wrong. Among
// three it should be named, and the pose be that of the other two; of two, nothing says which is
// the odd one, and the reading of each should be a hypothesis.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <utility>
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

constexpr double kRadiusError = 0.05;  // Relative.
constexpr double kLeastMiss = 10.0;    // Standard deviations by which the odd circle is off.

struct Case {
  int circles = 3;
  double tilt_deg = 0.0;  // 0: the radius is wrong instead.
};

struct OddScene {
  World world;
  std::size_t odd = 0;
  double miss = 0.0;  // Standard deviations.
  Bound others;       // Of the pose without the odd circle.
  Bound odd_alone;    // Of the pose by the odd circle alone, of two.
};

Bound BoundOf(const World& world, std::vector<std::uint8_t> circles, double noise_px) {
  BoundRequest request;
  request.noise_px = noise_px;
  request.circles = std::move(circles);
  return ComputeBound(world, request);
}

// How far off the odd circle is, given that all others are what they are said to be.
double Miss(const World& world, std::size_t odd, bool tilted, double noise_px) {
  BoundRequest request;
  request.noise_px = noise_px;
  (tilted ? request.tilted : request.resized) = static_cast<int>(odd);
  const Bound bound = ComputeBound(world, request);
  if (!bound.finite) return 0.0;
  if (!tilted) return kRadiusError / bound.log_radius;
  const Eigen::Vector2d& tilt = world.circles[odd].tilt;
  return std::sqrt(tilt.dot(bound.tilt.inverse() * tilt));
}

OddScene DrawOddScene(const Case& c, double noise_px, Random* random) {
  Recipe recipe;
  recipe.min_circles = recipe.max_circles = c.circles;
  recipe.max_pencils = 0;
  recipe.ring_share = recipe.partial_share = 0.0;
  recipe.min_tilt_deg = 20.0;
  recipe.max_tilt_deg = 70.0;
  recipe.min_points = 50;
  recipe.max_points = 200;
  const bool tilted = c.tilt_deg > 0.0;
  while (true) {
    OddScene scene;
    scene.world = DrawWorld(recipe, random);
    World& world = scene.world;
    scene.odd = static_cast<std::size_t>(random->UniformInt(c.circles));
    WorldCircle& odd = world.circles[scene.odd];
    if (tilted) {
      odd.tilt = c.tilt_deg * kDegree * Along(random->Uniform(0.0, 2.0 * kPi));
    } else {
      for (WorldCircle& circle : world.circles) circle.stated_radius = 1.0;
      odd.stated_radius = random->Uniform() < 0.5 ? 1.0 - kRadiusError : 1.0 + kRadiusError;
    }
    std::vector<std::uint8_t> others(world.circles.size(), 1), alone(world.circles.size(), 0);
    others[scene.odd] = 0;
    alone[scene.odd] = 1;
    scene.others = BoundOf(world, others, noise_px);
    scene.odd_alone = BoundOf(world, alone, noise_px);
    scene.miss = Miss(world, scene.odd, tilted, noise_px);
    if (IsVisible(world) && SmallestSemiMinorPx(world) >= 20.0 * noise_px && scene.others.finite &&
        scene.others.rotation_rad <= 2.0 * kDegree && scene.odd_alone.finite &&
        scene.odd_alone.rotation_rad <= 2.0 * kDegree && scene.miss >= kLeastMiss) {
      return scene;
    }
  }
}

// Whether a hypothesis is the pose by one circle: within 5 sigma of its bound, and nearer to it
// than a quarter of what the circles differ by.
bool IsReading(const OddScene& scene, const Case& c, bool by_odd, const PoseHypothesis& h) {
  const Bound& bound = by_odd ? scene.odd_alone : scene.others;
  const WorldCircle& odd = scene.world.circles[scene.odd];
  Eigen::Matrix3d truth = scene.world.pose.rotation;
  if (by_odd) truth *= ExpRotation({odd.tilt.x(), odd.tilt.y(), 0.0});
  const PoseError error = ComparePose(truth, true, h);
  double limit = 5.0 * bound.rotation_rad;
  if (c.tilt_deg > 0.0) {
    limit = std::max(limit, 0.25 * c.tilt_deg * kDegree);
    return error.angle <= limit;
  }
  if (error.angle > std::max(limit, kDegree)) return false;
  // By the wrong radius all distances are wrong by as much.
  const auto distance = [](const CameraPose& pose) {
    return std::abs(pose.rotation.col(2).dot(pose.translation));
  };
  const double expected = distance(scene.world.pose) * (by_odd ? odd.stated_radius : 1.0);
  return std::abs(std::log(distance(h.cam_from_world) / expected)) <
         std::max(0.25 * kRadiusError, 5.0 * bound.log_distance);
}

void RunCase(const ExperimentOptions& options, const Case& c, double noise, LossType loss) {
  const int trials = options.Trials(100);
  Settings settings;
  settings.loss = loss;
  int named = 0, named_others = 0, true_reading = 0, odd_reading = 0, both = 0, sure_wrong = 0;
  Tally tally;
  Progress progress("odd circles", trials);
  for (int trial = 0; trial < trials; ++trial) {
    Random random = options.TrialRandom(3, trial);
    const OddScene scene = DrawOddScene(c, noise, &random);
    const PoseEstimate estimate = Estimate(settings, Observe(scene.world, {noise, true}, &random));
    progress.Advance();
    if (!estimate.status.ok()) {
      tally.AddRefused();
      continue;
    }
    const PoseHypothesis& first = estimate.hypotheses.front();
    bool others_named = false;
    for (std::size_t i = 0; i < scene.world.circles.size(); ++i) {
      const bool left_out = IsLeftOut(estimate, first, "c" + std::to_string(i));
      if (i == scene.odd) {
        named += left_out ? 1 : 0;
      } else {
        others_named = others_named || left_out;
      }
    }
    named_others += others_named ? 1 : 0;
    PoseError error;
    // Of two nothing says which is right.
    if (c.circles > 2) {
      error = ComparePose(scene.world.pose.rotation, true, first);
    } else {
      Nearest(scene.world.pose.rotation, true, estimate, &error);
    }
    tally.Add(error, scene.others);
    sure_wrong += IsWrong(error, scene.others) && first.probability >= 0.99 ? 1 : 0;
    bool has[2] = {false, false};
    for (const PoseHypothesis& h : estimate.hypotheses) {
      for (const bool by_odd : {false, true}) {
        has[by_odd ? 1 : 0] = has[by_odd ? 1 : 0] || IsReading(scene, c, by_odd, h);
      }
    }
    true_reading += has[0] ? 1 : 0;
    odd_reading += has[1] ? 1 : 0;
    both += has[0] && has[1] ? 1 : 0;
  }
  progress.Clear();
  const auto percent = [trials](int part) { return FormatFixed(100.0 * part / trials, 1); };
  const std::string what =
      c.tilt_deg > 0.0 ? "tilted " + FormatPlain(c.tilt_deg) + " deg" : "radius 5 % off";
  const std::string readings = percent(true_reading) + "/" +
                               (c.circles == 2 ? percent(odd_reading) : "-") + "/" +
                               (c.circles == 2 ? percent(both) : "-");
  std::printf("  %d  %-14s  %6s %7s  %-17s %10s  %s\n", c.circles, what.c_str(),
              percent(named).c_str(), percent(named_others).c_str(), readings.c_str(),
              percent(sure_wrong).c_str(), tally.Row().c_str());
}

}  // namespace

void RunOddCircles(const ExperimentOptions& options) {
  for (const LossType loss : options.Losses({LossType::kCauchy})) {
    for (const double noise : options.Noises({0.5})) {
      std::printf(
          "One odd circle, >= 10 sigma off, noise %s px stated, loss %s; errors of the first "
          "hypothesis (of two circles: nearest) against the bound of the others\n",
          FormatPlain(noise).c_str(), LossName(loss));
      std::printf("  n  odd circle      named%% others%%  has true/odd/both wrong>=.99  %s\n",
                  Tally::Header().c_str());
      for (const int circles : {3, 2}) {
        for (const double tilt : {5.0, 10.0, 15.0, 0.0}) {
          RunCase(options, {circles, tilt}, noise, loss);
        }
      }
      std::printf("\n");
    }
  }
}

}  // namespace circline::apps
