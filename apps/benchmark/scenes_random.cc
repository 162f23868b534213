// Scenes of every kind. What counts is the regular ones; the others stand apart, by why they do.
#include <cstdio>
#include <map>
#include <string>
#include <tuple>

#include "apps/benchmark/scenes_bound.h"
#include "apps/benchmark/scenes_experiments.h"
#include "apps/benchmark/scenes_score.h"
#include "apps/benchmark/scenes_settings.h"
#include "apps/common/progress.h"
#include "apps/common/text.h"
#include "circline/estimators/basics.h"

namespace circline::apps {
namespace {

enum class Kind { kRegular, kBound, kSmall, kFrontal, kOblique, kShortArc };
constexpr int kNumKinds = 6;
const char* KindName(Kind kind) {
  switch (kind) {
    case Kind::kRegular:
      return "regular";
    case Kind::kBound:
      return "bound > 2 deg";
    case Kind::kSmall:
      return "semi-minor < 20 sigma";
    case Kind::kFrontal:
      return "tilt < 15 deg";
    case Kind::kOblique:
      return "tilt > 75 deg";
    case Kind::kShortArc:
      return "arc < 180 deg";
  }
  return "";
}

// The first reason that applies.
Kind Classify(const World& world, const Bound& bound, double noise_px) {
  if (!bound.finite || bound.rotation_rad > 2.0 * kDegree) return Kind::kBound;
  if (SmallestSemiMinorPx(world) < 20.0 * noise_px) return Kind::kSmall;
  if (Tilt(world) < 15.0 * kDegree) return Kind::kFrontal;
  if (Tilt(world) > 75.0 * kDegree) return Kind::kOblique;
  if (SmallestArc(world) < kPi) return Kind::kShortArc;
  return Kind::kRegular;
}

struct Results {
  std::map<std::tuple<bool, double, Kind>, Tally> tallies;
  std::map<std::tuple<bool, bool>, Calibration> calibrations;  // By stated, regular.
};

void RunTrial(const World& world, const Disturbance& disturbance, LossType loss, Random* random,
              Results* results) {
  BoundRequest request;
  request.noise_px = disturbance.noise_px;
  const Bound bound = ComputeBound(world, request);
  if (!bound.finite) return;
  const Kind kind = Classify(world, bound, disturbance.noise_px);
  Settings settings;
  settings.loss = loss;
  const PoseEstimate estimate = Estimate(settings, Observe(world, disturbance, random));
  Tally& tally = results->tallies[{disturbance.stated, disturbance.noise_px, kind}];
  if (!estimate.status.ok() || estimate.hypotheses.empty()) {
    tally.AddRefused();
    return;
  }
  PoseError nearest;
  Nearest(world.pose.rotation, bound.spin_is_free, estimate, &nearest);
  tally.Add(nearest, bound);
  if (kind == Kind::kBound) return;  // There, anything would be right.
  const PoseHypothesis& first = estimate.hypotheses.front();
  const bool right = !IsWrong(ComparePose(world.pose.rotation, bound.spin_is_free, first), bound);
  results->calibrations[{disturbance.stated, kind == Kind::kRegular}].Add(first.probability, right);
}

void Print(const std::vector<double>& noises, const Results& results) {
  std::printf("  noise             class                  %s\n", Tally::Header().c_str());
  for (int k = 0; k < kNumKinds; ++k) {
    const Kind kind = static_cast<Kind>(k);
    for (const bool stated : {true, false}) {
      for (const double noise : noises) {
        const auto found = results.tallies.find({stated, noise, kind});
        if (found == results.tallies.end()) continue;
        const std::string name = FormatPlain(noise) + (stated ? " stated" : " not stated");
        std::printf("  %-16s  %-21s  %s\n", name.c_str(), KindName(kind),
                    found->second.Row().c_str());
      }
    }
  }
  for (const auto& [key, calibration] : results.calibrations) {
    const auto [stated, regular] = key;
    std::printf("  Probability of the first hypothesis, noise %s, %s:\n",
                stated ? "stated" : "not stated", regular ? "regular" : "others, bound <= 2 deg");
    calibration.Print();
  }
}

}  // namespace

void RunRandomScenes(const ExperimentOptions& options) {
  const int trials = options.Trials(150);
  const std::vector<double> noises = options.Noises({0.1, 0.5, 1.0, 2.0});
  for (const LossType loss : options.Losses({LossType::kCauchy})) {
    Results results;
    Progress progress("random scenes", trials);
    for (int trial = 0; trial < trials; ++trial) {
      Random random = options.TrialRandom(1, trial);
      const World world = DrawWorld(Recipe(), &random);
      for (const double noise : noises) {
        for (const bool stated : {true, false}) {
          Random noise_random = random;
          Disturbance disturbance;
          disturbance.noise_px = noise;
          disturbance.stated = stated;
          RunTrial(world, disturbance, loss, &noise_random, &results);
        }
      }
      progress.Advance();
    }
    progress.Clear();
    std::printf("Random scenes, hypothesis nearest the truth, loss %s\n", LossName(loss));
    Print(noises, results);
    std::printf("\n");
  }
}

}  // namespace circline::apps
