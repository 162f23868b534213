// Two pencils, of which one line is not parallel to the others of its pencil.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/refine/estimate_pose.h"
#include "tests/plane_scene.h"
#include "tests/trials.h"

namespace circline {
namespace {

using Eigen::Vector3d;

struct OddScene {
  PlaneScene scene;
  Observations observations;

  // `lines` of each pencil, here and there; the first of the second is off by 5 to 25 degrees.
  OddScene(int lines, int seed)
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
        if (is_second && k == 0)
          angle += std::copysign(random.Uniform(5.0, 25.0) * kDegree, random.Uniform(-1.0, 1.0));
        const double half = random.Uniform(0.5, 1.5);
        const Vector3d middle(random.Uniform(-2.5, 2.5), random.Uniform(-2.5, 2.5), 0.0),
            along(half * std::cos(angle), half * std::sin(angle), 0.0);
        pencil.lines[static_cast<std::size_t>(k)] = scene.Line(middle - along, middle + along, 30);
      }
      observations.pencils.push_back(pencil);
    }
  }
};

bool IsRight(const PoseHypothesis& h, const PlaneScene& scene) {
  return NormalError(h, scene) < 2.0 * kDegree || NormalErrors(h, scene.pose).Nees() < 25.0;
}

// A fit of all lines leads far from where those that meet lie.
TEST(OddPencilsTest, TheOddLineIsLeftOutAndTheAnswerHonest) {
  constexpr int kScenes = Trials(150);
  for (const NoiseModel& model : {NoiseModel::Exact(), NoiseModel()}) {
    EstimationOptions options;
    options.noise_model = model;
    int missing = 0, sure_and_wrong = 0;
    for (int i = 0; i < kScenes; ++i) {
      const OddScene odd(4, i + 1);
      const PoseEstimate estimate = EstimatePose(odd.observations, options);
      ASSERT_TRUE(estimate.status.ok()) << estimate.status.message;
      const std::vector<PoseHypothesis>& all = estimate.hypotheses;
      const bool is_there = std::any_of(
          all.begin(), all.end(), [&](const PoseHypothesis& h) { return IsRight(h, odd.scene); });
      missing += is_there ? 0 : 1;
      sure_and_wrong += all[0].probability >= 0.95 && !IsRight(all[0], odd.scene) ? 1 : 0;
    }
    std::printf("missing in %d, sure and wrong in %d of %d\n", missing, sure_and_wrong, kScenes);
    EXPECT_LE(missing, 0.01 * kScenes);
    EXPECT_LE(sure_and_wrong, 0.01 * kScenes);
  }
}

}  // namespace
}  // namespace circline
