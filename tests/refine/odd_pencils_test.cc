// Two pencils, of which one line is not parallel to the others of its pencil.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/refine/estimate_pose.h"
#include "tests/basics.h"
#include "tests/plane_scene.h"
#include "tests/refine/simulated_options.h"
#include "tests/trials.h"

namespace circline {
namespace {

using Eigen::Vector3d;

struct OddScene {
  PlaneScene scene;
  Observations observations;

  // `lines` of each pencil, here and there; the first of the second is off by 5 to 25 degrees,
  // where `is_odd`.
  OddScene(int lines, int seed, bool is_odd = true)
      : scene(Random(static_cast<std::uint64_t>(seed)).Uniform(0.3, 1.2), 0.5,
              static_cast<std::uint64_t>(seed)),
        observations(scene.Empty()) {
    Random random(static_cast<std::uint64_t>(seed) + 1000);
    for (const PencilDirection role : {PencilDirection::kX, PencilDirection::kY}) {
      const bool is_second = role == PencilDirection::kY;
      PencilObservation pencil =
          scene.Pencil(is_second ? "b" : "a", role, Vector3d::Unit(is_second ? 1 : 0), lines);
      for (int k = 0; k < lines; ++k) {
        double angle = is_second ? 0.5 * kPi : 0.0;
        if (is_odd && is_second && k == 0) {
          const double off = random.Uniform(5.0, 25.0) * kDegree;
          angle += std::copysign(off, random.Uniform(-1.0, 1.0));
        }
        const double half = random.Uniform(0.5, 1.5);
        const Vector3d middle{random.Uniform(-2.5, 2.5), random.Uniform(-2.5, 2.5), 0.0},
            along{half * std::cos(angle), half * std::sin(angle), 0.0};
        pencil.lines[static_cast<std::size_t>(k)] = scene.Line(middle - along, middle + along, 30);
      }
      observations.pencils.push_back(pencil);
    }
  }
};

bool IsRight(const PoseHypothesis& h, const PlaneScene& scene) {
  return NormalError(h, scene) < 2.0 * kDegree || NormalErrors(h, scene.pose).Nees() < 25.0;
}

bool IsAmong(const PoseEstimate& estimate, const PlaneScene& scene) {
  return std::any_of(estimate.hypotheses.begin(), estimate.hypotheses.end(),
                     [&](const PoseHypothesis& h) { return IsRight(h, scene); });
}

// A fit of all lines leads far from where those that meet lie. Of 3000 scenes the right answer is
// missing in 5 with point noise alone, in 21 with that of photographs.
TEST(OddPencilsTest, TheOddLineIsLeftOutAndTheAnswerHonest) {
  constexpr int kScenes = Trials(400);
  for (const NoiseModel& model : {NoiseModel::Exact(), NoiseModel()}) {
    EstimationOptions options;
    options.noise_model = model;
    int missing = 0, sure_and_wrong = 0;
    for (int i = 0; i < kScenes; ++i) {
      const OddScene odd(4, i + 1);
      const PoseEstimate estimate = Ok(EstimatePose(odd.observations, options));
      const PoseHypothesis& best = estimate.hypotheses[0];
      missing += IsAmong(estimate, odd.scene) ? 0 : 1;
      sure_and_wrong += best.probability >= 0.95 && !IsRight(best, odd.scene) ? 1 : 0;
    }
    std::printf("missing in %d, sure and wrong in %d of %d\n", missing, sure_and_wrong, kScenes);
    EXPECT_LE(missing, 0.01 * kScenes);
    EXPECT_LE(sure_and_wrong, 0.01 * kScenes);
  }
}

// All lines contradict it a little, and it contradicts what they say. One is told less well than it
// is off.
TEST(OddPencilsTest, AWrongAngleIsLeftOut) {
  constexpr int kScenes = Trials(100);
  int missing = 0, sure_and_wrong = 0;
  for (int i = 0; i < kScenes; ++i) {
    OddScene odd(4, i + 1, false);
    for (PencilObservation& pencil : odd.observations.pencils)
      pencil.direction = PencilDirection::kFree;
    const double off = (i % 2 == 0 ? 10.0 : 20.0) * kDegree;
    odd.observations.known_angles = {{{"a", "b"}, 0.5 * kPi - off, 0.1 * kDegree}};
    const PoseEstimate estimate = Ok(EstimatePose(odd.observations, Exact()));
    const PoseHypothesis& best = estimate.hypotheses[0];
    missing += IsAmong(estimate, odd.scene) ? 0 : 1;
    sure_and_wrong += best.probability >= 0.95 && !IsRight(best, odd.scene) ? 1 : 0;
  }
  std::printf("missing in %d, sure and wrong in %d of %d\n", missing, sure_and_wrong, kScenes);
  EXPECT_EQ(missing, 0);
  EXPECT_LE(sure_and_wrong, 1);
}

}  // namespace
}  // namespace circline
