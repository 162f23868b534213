// A direction of gravity that is known beside the photo: evidence like any other.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <string>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/refine/estimate_pose.h"
#include "tests/plane_scene.h"
#include "tests/refine/round_scene.h"
#include "tests/refine/simulated_options.h"
#include "tests/trials.h"

namespace circline {
namespace {

using Eigen::Vector3d;

GravityPrior Measured(const Vector3d& in_world, double sigma_rad, PlaneScene* scene) {
  GravityPrior gravity;
  gravity.in_world = in_world;
  const Vector3d exact = scene->pose.rotation * in_world, a = exact.unitOrthogonal();
  const double along_a = scene->random.Normal(), along_b = scene->random.Normal();
  gravity.in_camera = (exact + sigma_rad * (along_a * a + along_b * exact.cross(a))).normalized();
  gravity.sigma_rad = sigma_rad;
  return gravity;
}

// A round thing on the ground: gravity tells which of its two planes is level.
TEST(GravityPriorTest, DecidesBetweenThePosesOfACircle) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    PlaneScene scene(0.6, 0.3, seed);
    const Observations observations = OneCircle(&scene);
    EstimationOptions options = LeastSquares();
    options.gravity_prior = Measured(-Vector3d::UnitZ(), 0.02, &scene);
    const PoseHypothesis h = Best(EstimatePose(observations, options));
    EXPECT_GT(h.probability, 0.999) << seed;
    EXPECT_LT(NormalError(h, scene), 0.06) << seed;
    EXPECT_TRUE(h.RotationIsFree());  // Along the normal it does not tell the spin.
    // One that is known no better than by the hand says little.
    options.gravity_prior->sigma_rad = 1.5;
    const PoseEstimate vague = EstimatePose(observations, options);
    ASSERT_EQ(vague.hypotheses.size(), 2U) << seed;
    EXPECT_LT(vague.hypotheses[0].probability, 0.8) << seed;
  }
}

TEST(GravityPriorTest, CannotDecideWhereBothPosesAgreeWithIt) {
  PlaneScene scene(0.6, 0.2);
  const Observations observations = OneCircle(&scene);
  const PoseEstimate both = EstimatePose(observations, LeastSquares());
  ASSERT_EQ(both.hypotheses.size(), 2U);
  EstimationOptions options = LeastSquares();
  options.gravity_prior = GravityPrior{};
  options.gravity_prior->in_world = Vector3d::UnitZ();
  options.gravity_prior->in_camera = (both.hypotheses[0].cam_from_world.rotation.col(2) +
                                      both.hypotheses[1].cam_from_world.rotation.col(2))
                                         .normalized();
  options.gravity_prior->sigma_rad = 0.3;
  const PoseEstimate estimate = EstimatePose(observations, options);
  ASSERT_EQ(estimate.hypotheses.size(), 2U) << estimate.status.message;
  EXPECT_NEAR(estimate.hypotheses[0].probability, 0.5, 0.05);
}

// The normal from a circle and from gravity: honest together.
TEST(GravityPriorTest, EntersTheCovariance) {
  constexpr int kTrials = Trials(400);
  double nees = 0.0, with = 0.0, without = 0.0;
  for (int i = 0; i < kTrials; ++i) {
    PlaneScene scene(0.6, 0.4, static_cast<std::uint64_t>(i + 1));
    const Observations observations = OneCircle(&scene);
    EstimationOptions options = LeastSquares();
    const PoseEstimate alone = EstimatePose(observations, options);
    options.gravity_prior = Measured(-Vector3d::UnitZ(), 0.003, &scene);
    const NormalErrors normal(Best(EstimatePose(observations, options)), scene.pose);
    nees += normal.Nees() / kTrials;
    with += normal.covariance.trace() / kTrials;
    without += alone.hypotheses[0].Covariance().topLeftCorner<3, 3>().trace() / kTrials;
  }
  if (kSanitized) return;
  EXPECT_NEAR(nees, 2.0, 0.4);  // 400 trials: +- 0.1.
  EXPECT_LT(with, 0.8 * without);
  EXPECT_LT(with, 2.0 * 0.003 * 0.003);
}

// A circle on a wall: gravity lies in its plane and tells the spin, whichever way the axes point in
// the photo.
TEST(GravityPriorTest, TellsTheSpinOfACircleOnAWall) {
  for (const double turn : {0.0, 1.5, 3.1, -2.0}) {
    PlaneScene scene(0.7, 0.2);
    scene.pose.rotation = scene.pose.rotation * ExpRotation({0.0, 0.0, turn});
    Observations observations = OneCircle(&scene);
    observations.circles[0].center = scene.Pixel(0.0, 0.0);
    EstimationOptions options = LeastSquares();
    options.gravity_prior = Measured(-Vector3d::UnitY(), 0.01, &scene);
    const PoseHypothesis h = Best(EstimatePose(observations, options));
    EXPECT_FALSE(h.RotationIsFree());
    EXPECT_LT(RotationAngle(h.cam_from_world.rotation, scene.pose.rotation), 0.05) << turn;
    EXPECT_LT(h.SigmaRotation().maxCoeff(), 0.02) << turn;
  }
}

// What the photo contradicts, an accelerometer in a braking car, is left out and named; what agrees
// is not.
TEST(GravityPriorTest, IsLeftOutWhereThePhotoContradictsIt) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    PlaneScene scene(0.6, 0.3, seed);
    Observations observations = CircleAndAxes(&scene);
    for (const double off : {0.0, 0.15, 0.6}) {
      EstimationOptions options = LeastSquares();
      options.gravity_prior = Measured(-Vector3d::UnitZ(), 0.01, &scene);
      options.gravity_prior->in_camera =
          ExpRotation(off * Vector3d::UnitX()) * options.gravity_prior->in_camera;
      const PoseHypothesis h = Best(EstimatePose(observations, options));
      EXPECT_EQ(h.left_out,
                off > 0.0 ? std::vector<std::string>{"gravity_prior"} : std::vector<std::string>());
      EXPECT_LT(NormalError(h, scene), 0.02) << seed;
      EXPECT_GT(h.probability, 0.99);
    }
  }
}

// A circle on a wall again: that gravity tells the spin, and nothing does without it, is no reason
// to leave it out, and none to keep it.
TEST(GravityPriorTest, IsLeftOutAtTheOddsOfItsDensity) {
  PlaneScene scene(0.7, 0.2);
  Observations observations = OneCircle(&scene);
  observations.circles[0].center = scene.Pixel(0.0, 0.0);
  EstimationOptions options = LeastSquares();
  const PoseHypothesis alone = Best(EstimatePose(observations, options));
  const Vector3d normal = alone.cam_from_world.rotation.col(2),
                 in_plane = -scene.pose.rotation.col(1), across = normal.cross(in_plane);
  constexpr double kSigma = 0.01;
  const double variance =
      kSigma * kSigma + across.dot(alone.Covariance().topLeftCorner<3, 3>() * across);
  const double off = 5.0 * std::sqrt(variance);
  GravityPrior gravity;
  gravity.in_world = -Vector3d::UnitY();
  const Vector3d level = (in_plane - normal * normal.dot(in_plane)).normalized();
  gravity.in_camera = std::cos(off) * level + std::sin(off) * normal;
  gravity.sigma_rad = kSigma;
  options.gravity_prior = gravity;
  const PoseEstimate both = EstimatePose(observations, options);
  ASSERT_GE(both.hypotheses.size(), 2U) << both.status.message;
  double with = 0.0, without = 0.0;
  for (const PoseHypothesis& h : both.hypotheses)
    (h.left_out.empty() ? with : without) += h.probability;
  // Any turn in the plane, a Gaussian across it; or one of 50 that has nothing to do with the
  // world, anywhere on half of the sphere.
  const double right = std::exp(-0.5 * 5.0 * 5.0) / (2.0 * kPi * std::sqrt(2.0 * kPi * variance)),
               wrong = 0.02 / (2.0 * kPi);
  EXPECT_NEAR(std::log(without / with), std::log(wrong / right), 0.2);
}

// It has a sense: of lines alone it tells which way an axis points.
TEST(GravityPriorTest, TellsTheSenseOfAnAxis) {
  for (const double turn : {0.0, 3.1}) {
    PlaneScene scene(0.7, 0.2);
    scene.pose.rotation = scene.pose.rotation * ExpRotation({0.0, 0.0, turn});
    Observations observations = scene.Empty();
    observations.pencils = {scene.Pencil("L1", PencilDirection::kX, Vector3d::UnitX()),
                            scene.Pencil("L2", PencilDirection::kY, Vector3d::UnitY())};
    EstimationOptions options = LeastSquares();
    options.gravity_prior = Measured(-Vector3d::UnitY(), 0.01, &scene);
    const PoseHypothesis h = Best(EstimatePose(observations, options));
    EXPECT_LT(RotationAngle(h.cam_from_world.rotation, scene.pose.rotation), 0.05) << turn;
  }
}

// Along the normal it does not tell the sense of an axis: X points to the right, by convention.
TEST(GravityPriorTest, AlongTheNormalLeavesTheSenseOfAnAxis) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    PlaneScene scene(0.7, 0.2, seed);
    EstimationOptions options = LeastSquares();
    options.gravity_prior = Measured(-Vector3d::UnitZ(), 0.01, &scene);
    const PoseHypothesis h = Best(EstimatePose(CircleAndAxes(&scene), options));
    EXPECT_LT(RotationAngle(h.cam_from_world.rotation, scene.pose.rotation), 0.05) << seed;
  }
}

// What a corridor shows: lines of one direction. With gravity, which is not along it, they fix the
// rotation.
struct OnePencil {
  PencilDirection role;
  Vector3d along, gravity;  // In the world.
};
class OnePencilTest : public ::testing::TestWithParam<OnePencil> {
 protected:
  // Sets the options' prior.
  Observations Draw(PlaneScene* scene) {
    options_.gravity_prior = Measured(GetParam().gravity.normalized(), 0.005, scene);
    Observations observations = scene->Empty();
    observations.frame.plane = "p0";
    observations.pencils = {scene->Pencil("L", GetParam().role, GetParam().along, 4, 20)};
    return observations;
  }
  EstimationOptions options_ = LeastSquares();
};

TEST_P(OnePencilTest, FixesTheRotationWithGravity) {
  constexpr int kTrials = Trials(400);
  double nees = 0.0;
  int within = 0;
  for (int i = 0; i < kTrials; ++i) {
    PlaneScene scene(0.6, 0.4, static_cast<std::uint64_t>(i + 1));
    const Observations observations = Draw(&scene);
    const PoseEstimate estimate = Ok(EstimatePose(observations, options_));
    EXPECT_EQ(estimate.hypotheses.size(), 1U) << i;
    const PoseHypothesis& h = estimate.hypotheses[0];
    EXPECT_TRUE(h.free_directions.empty());
    nees += RotationNees(h, scene.pose) / kTrials;
    const Vector3d off = LogRotation(scene.pose.rotation * h.cam_from_world.rotation.transpose());
    for (int k = 0; k < 3; ++k) within += std::abs(off[k]) < 2.0 * h.SigmaRotation()[k] ? 1 : 0;
  }
  const double covered = within / (3.0 * kTrials);
  std::printf("NEES %.2f, within two sigma %.3f\n", nees, covered);
  if (kSanitized) return;
  EXPECT_NEAR(nees, 3.0, 0.4);  // 400 trials: +- 0.12, and 0.954 +- 0.007.
  EXPECT_NEAR(covered, 0.954, 0.024);
}

INSTANTIATE_TEST_SUITE_P(
    GravityPrior, OnePencilTest,
    ::testing::Values(OnePencil{PencilDirection::kX, Vector3d::UnitX(), -Vector3d::UnitZ()},
                      OnePencil{PencilDirection::kY, Vector3d::UnitY(), -Vector3d::UnitZ()},
                      OnePencil{PencilDirection::kX, Vector3d::UnitX(), -Vector3d::UnitY()},
                      OnePencil{PencilDirection::kX, Vector3d::UnitX(), {0.5, -0.6, 0.6}},
                      OnePencil{PencilDirection::kZ, Vector3d::UnitZ(), -Vector3d::UnitY()},
                      OnePencil{PencilDirection::kFree, Vector3d::UnitX(), -Vector3d::UnitY()}));

// Which of both is wrong nothing tells: without gravity it is one pose that may turn about the
// pencil, and no more.
TEST(GravityPriorTest, IsLeftOutWhereTheOnlyPencilContradictsIt) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    PlaneScene scene(0.6, 0.4, seed);
    Observations observations = scene.Empty();
    observations.pencils = {scene.Pencil("L", PencilDirection::kX, Vector3d::UnitX(), 4, 20)};
    EstimationOptions options = LeastSquares();
    options.gravity_prior = Measured(-Vector3d::UnitZ(), 0.005, &scene);
    options.gravity_prior->in_camera =
        ExpRotation({0.3, 0.3, 0.3}) * options.gravity_prior->in_camera;
    const PoseEstimate estimate = Ok(EstimatePose(observations, options));
    int without = 0;
    for (const PoseHypothesis& h : estimate.hypotheses) {
      if (h.left_out != std::vector<std::string>{"gravity_prior"}) continue;
      ++without;
      EXPECT_EQ(h.free_directions.size(), 1U);
    }
    EXPECT_EQ(without, 1) << seed;
  }
}

TEST(GravityPriorTest, AlongTheOnlyPencilItSaysNothingMore) {
  PlaneScene scene(0.6, 0.2);
  Observations observations = scene.Empty();
  observations.pencils = {scene.Pencil("L", PencilDirection::kX, Vector3d::UnitX(), 4, 20)};
  EstimationOptions options = LeastSquares();
  const auto message = [&] { return EstimatePose(observations, options).status.message; };
  const std::string alone = message();
  EXPECT_EQ(alone.find("there is only one pencil of parallel lines ('L')"), 0U) << alone;
  options.gravity_prior = Measured(Vector3d::UnitX(), 1e-3, &scene);
  EXPECT_EQ(message(), alone);
}

}  // namespace
}  // namespace circline
