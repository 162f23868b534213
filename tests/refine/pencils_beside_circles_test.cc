// A free pencil of no plane beside a circle: which of the circle's two poses it speaks for.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>

#include "circline/estimators/basics.h"
#include "circline/estimators/random.h"
#include "circline/refine/estimate_pose.h"
#include "tests/basics.h"
#include "tests/plane_scene.h"
#include "tests/refine/simulated_options.h"
#include "tests/trials.h"

namespace circline {
namespace {

using Eigen::Vector3d;

constexpr double kSigmaPx = 0.3;

// A plate, and planks beside it.
Observations Beside(const Vector3d& direction, PlaneScene* scene) {
  Observations observations = scene->Empty();
  observations.circles = {scene->Circle("c0", 0.5, 0.2, 1.5)};
  observations.pencils = {scene->Pencil("L0", PencilDirection::kFree, direction, 4, 20)};
  observations.pencils[0].plane.clear();
  return observations;
}

Vector3d InPlane(double angle) { return {std::cos(angle), std::sin(angle), 0.0}; }

Vector3d AnyWay(Random* random) {
  const double x = random->Normal(), y = random->Normal(), z = random->Normal();
  return Vector3d(x, y, z).normalized();
}

// Of the first pose.
bool IsRight(const PoseEstimate& estimate, const PlaneScene& scene) {
  return NormalError(estimate.hypotheses[0], scene) < NormalError(estimate.hypotheses[1], scene);
}

class RelatedPencils : public testing::TestWithParam<Vector3d> {};

TEST_P(RelatedPencils, TellThePose) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    PlaneScene scene(0.7, kSigmaPx, seed);
    const PoseEstimate estimate = Ok(EstimatePose(Beside(GetParam(), &scene)));
    ASSERT_EQ(estimate.hypotheses.size(), 2U);
    EXPECT_TRUE(IsRight(estimate, scene));
    EXPECT_GT(estimate.hypotheses[0].probability, 0.9);
    EXPECT_NE(estimate.notes.front().find("'L0'"), std::string::npos);
  }
}

INSTANTIATE_TEST_SUITE_P(InPlaneOrAlongNormal, RelatedPencils,
                         testing::Values(InPlane(1.2), InPlane(2.0), Vector3d(0.0, 0.0, 1.0)));

TEST(PencilsBesideCircles, SayNothingOfWhatTheyMissBothWays) {
  PlaneScene scene(0.7, kSigmaPx);
  const PoseEstimate estimate =
      Ok(EstimatePose(Beside(Vector3d(0.7, 0.3, 0.5).normalized(), &scene)));
  ASSERT_EQ(estimate.hypotheses.size(), 2U);
  EXPECT_NEAR(estimate.hypotheses[0].probability, 0.5, 0.05);
}

// One that is said to lie in another plane is believed to.
TEST(PencilsBesideCircles, SayNothingFromAnotherPlane) {
  PlaneScene scene(0.7, kSigmaPx);
  Observations observations = Beside(InPlane(1.2), &scene);
  observations.pencils[0].plane = "p1";
  const PoseEstimate estimate = Ok(EstimatePose(observations));
  ASSERT_EQ(estimate.hypotheses.size(), 2U);
  EXPECT_NEAR(estimate.hypotheses[0].probability, 0.5, 0.05);
}

// A guessed focal length turns the circle's normals and the pencil's direction alike.
TEST(PencilsBesideCircles, SayLessWhereTheFocalLengthIsOpen) {
  PlaneScene scene(0.7, kSigmaPx);
  const Observations observations = Beside(InPlane(1.2), &scene);
  EstimationOptions options;
  options.camera_sigma = CameraSigma();
  options.camera_sigma->log_focal = 0.2;
  const PoseEstimate known = Ok(EstimatePose(observations)),
                     open = Ok(EstimatePose(observations, options));
  EXPECT_TRUE(IsRight(open, scene));
  EXPECT_GT(open.hypotheses[0].probability, 0.6);
  EXPECT_LT(open.hypotheses[0].probability, known.hypotheses[0].probability);
}

struct Count {
  int scenes = 0, right = 0;
  double stated = 0.0;
};

void Draw(double related, std::array<Count, 4>* bins, Random* random) {
  constexpr std::array<double, 3> kEdges = {0.6, 0.8, 0.95};
  const double away = random->Uniform() < 0.5 ? -1.0 : 1.0;  // Ties keep an order by convention.
  const double tilt = away * random->Uniform(0.4, 1.0);
  PlaneScene scene(tilt, kSigmaPx, static_cast<std::uint64_t>(random->UniformInt(1000000)));
  const double kind = random->Uniform(), angle = random->Uniform(0.0, kPi);
  const Vector3d any = AnyWay(random);
  const Vector3d direction = kind < 0.7 * related ? InPlane(angle)
                             : kind < related     ? Vector3d(0.0, 0.0, 1.0)
                                                  : any;
  const PoseEstimate estimate = EstimatePose(Beside(direction, &scene), LeastSquares());
  if (!estimate.status.ok() || estimate.hypotheses.size() != 2) return;
  const double p = estimate.hypotheses[0].probability;
  const auto bin = std::upper_bound(kEdges.begin(), kEdges.end(), p) - kEdges.begin();
  Count& count = (*bins)[static_cast<std::size_t>(bin)];
  ++count.scenes;
  count.stated += p;
  count.right += IsRight(estimate, scene) ? 1 : 0;
}

// Where half of the pencils have to do with the circle the stated probability is how often the
// first pose is right.
TEST(PencilsBesideCircles, ProbabilitiesAreCalibrated) {
  std::array<Count, 4> bins;
  Random random(5);
  const int scenes = Trials(1000);
  for (int i = 0; i < scenes; ++i) Draw(0.5, &bins, &random);
  if (kSanitized) return;
  for (const Count& bin : bins) {
    const double n = bin.scenes, stated = bin.stated / n, right = bin.right / n;
    std::printf("stated %.3f, right %.3f of %d\n", stated, right, bin.scenes);
    EXPECT_NEAR(right, stated, 4.0 * std::sqrt(stated * (1.0 - stated) / n) + 1.0 / n);
  }
}

// Unrelated pencils seldom pass for related ones: in one scene of twenty, rightly in half of these.
TEST(PencilsBesideCircles, UnrelatedOnesSeldomDecide) {
  std::array<Count, 4> bins;
  Random random(6);
  const int scenes = Trials(1000);
  for (int i = 0; i < scenes; ++i) Draw(0.0, &bins, &random);
  if (kSanitized) return;
  for (const Count& bin : bins)
    std::printf("stated %.3f, right %d of %d\n", bin.stated / bin.scenes, bin.right, bin.scenes);
  const Count& sure = bins.back();
  EXPECT_LT(sure.scenes - sure.right, 0.025 * scenes);
}

}  // namespace
}  // namespace circline
