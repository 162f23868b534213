// What is known of the pose beside the photo: one to start from, which is no evidence; one with its
// covariance, which is evidence like any other.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <vector>

#include "circline/refine/estimate_pose.h"
#include "tests/basics.h"
#include "tests/plane_scene.h"
#include "tests/refine/round_scene.h"
#include "tests/refine/simulated_options.h"
#include "tests/trials.h"

namespace circline {
namespace {

using Eigen::Vector3d;

double Between(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

PosePrior Around(const CameraPose& mean, double sigma_rad, double sigma_t) {
  PosePrior prior;
  prior.mean = mean;
  Eigen::Map<Matrix6d> covariance(prior.covariance.data());
  covariance.setZero();
  covariance.diagonal().head<3>().setConstant(sigma_rad * sigma_rad);
  covariance.diagonal().tail<3>().setConstant(sigma_t * sigma_t);
  return prior;
}

// The hypothesis whose normal is nearest.
const PoseHypothesis& Nearest(const PoseEstimate& estimate, const Vector3d& normal) {
  return *std::min_element(estimate.hypotheses.begin(), estimate.hypotheses.end(),
                           [&](const PoseHypothesis& a, const PoseHypothesis& b) {
                             return Between(a.cam_from_world.rotation.col(2), normal) <
                                    Between(b.cam_from_world.rotation.col(2), normal);
                           });
}

TEST(PriorTest, APoseToStartFromKeepsBothPosesOfACircle) {
  PlaneScene scene(0.7, 0.2);
  const Observations observations = OneCircle(&scene);
  const PoseEstimate both = EstimatePose(observations, LeastSquares());
  ASSERT_EQ(both.hypotheses.size(), 2U);
  EstimationOptions options = LeastSquares();
  for (const PoseHypothesis& start : both.hypotheses) {
    options.prior = start.cam_from_world;
    options.prior->rotation = ExpRotation({0.01, -0.02, 0.01}) * options.prior->rotation;
    const PoseEstimate estimate = EstimatePose(observations, options);
    ASSERT_EQ(estimate.hypotheses.size(), 2U) << estimate.status.message;
    for (const PoseHypothesis& expected : both.hypotheses) {
      const Vector3d normal = expected.cam_from_world.rotation.col(2);
      const PoseHypothesis& h = Nearest(estimate, normal);
      EXPECT_LT(Between(h.cam_from_world.rotation.col(2), normal), 1e-5);
      EXPECT_NEAR(h.probability, expected.probability, 1e-3);
      EXPECT_LT((h.Covariance() - expected.Covariance()).norm(), 1e-3 * h.Covariance().norm());
    }
  }
}

TEST(PriorTest, APoseToStartFromIsNoEvidence) {
  PlaneScene scene(0.7, 0.3);
  Observations observations = CircleAndAxes(&scene);
  EstimationOptions options = LeastSquares();
  const PoseHypothesis expected = Best(EstimatePose(observations, options));
  // Near, and far off: a plane seen from behind its edge.
  for (const Vector3d& off : {Vector3d(0.05, -0.04, 0.02), Vector3d(1.5, 0.0, 0.0)}) {
    options.prior = scene.pose;
    options.prior->rotation = ExpRotation(off) * scene.pose.rotation;
    options.prior->translation *= 3.0;  // Its unit has no meaning.
    const PoseHypothesis h = Best(EstimatePose(observations, options));
    EXPECT_LT(RotationAngle(h.cam_from_world.rotation, expected.cam_from_world.rotation), 1e-6);
    EXPECT_NEAR(h.probability, expected.probability, 1e-3);
    EXPECT_LT((h.Covariance() - expected.Covariance()).norm(), 1e-3 * h.Covariance().norm());
  }
}

// A pose that is known from elsewhere is a start where nothing else is, and one pencil makes it
// better.
TEST(PriorTest, OnePencilRefinesAPoseKnownFromElsewhere) {
  constexpr double kSigma = 0.02;
  constexpr int kTrials = Trials(400);
  double nees = 0.0, variance = 0.0;
  for (int i = 0; i < kTrials; ++i) {
    PlaneScene scene(0.6, 0.4, static_cast<std::uint64_t>(i + 1));
    Observations observations = scene.Empty();
    observations.pencils = {scene.Pencil("L", PencilDirection::kX, Vector3d::UnitX(), 4, 20)};
    EstimationOptions options = LeastSquares();
    options.pose_prior = Around(scene.pose, kSigma, 1.0);
    Eigen::Matrix3d& mean = options.pose_prior->mean.rotation;
    mean = ExpRotation(Noise3(kSigma, &scene.random)) * mean;
    const PoseEstimate estimate = Ok(EstimatePose(observations, options));
    EXPECT_EQ(estimate.hypotheses.size(), 1U) << i;
    nees += RotationNees(estimate.hypotheses[0], scene.pose) / kTrials;
    variance += estimate.hypotheses[0].SigmaRotation().squaredNorm() / kTrials;
  }
  if (kSanitized) return;
  EXPECT_NEAR(nees, 3.0, 0.4);  // 400 trials: +- 0.12.
  // Of three turns the pencil leaves that about itself.
  EXPECT_LT(variance, 1.3 * kSigma * kSigma);
  EXPECT_GT(variance, 0.9 * kSigma * kSigma);
}

// Without any evidence it is no estimate.
TEST(PriorTest, APriorAloneIsNoEstimate) {
  PlaneScene scene(0.6, 0.2);
  EstimationOptions options = LeastSquares();
  options.pose_prior = Around(scene.pose, 0.02, 1.0);
  options.gravity_prior = GravityPrior{};
  const Status status = EstimatePose(scene.Empty(), options).status;
  EXPECT_EQ(status.code, StatusCode::kRefused) << status.message;
  EXPECT_NE(status.message.find("there is neither"), std::string::npos) << status.message;
}

TEST(PriorTest, BadPriorsAreNamed) {
  PlaneScene scene(0.7, 0.2);
  const Observations observations = OneCircle(&scene);
  const auto message = [&](const EstimationOptions& options) {
    const PoseEstimate estimate = EstimatePose(observations, options);
    EXPECT_EQ(estimate.status.code, StatusCode::kInvalidArgument);
    return estimate.status.message;
  };
  for (const double scale : {0.0, -1.0}) {  // No rotation; a reflection.
    EstimationOptions start = LeastSquares(), evidence = LeastSquares();
    start.prior = scene.pose;
    start.prior->rotation *= scale;
    EXPECT_EQ(message(start).find("prior must be"), 0U);
    evidence.pose_prior = Around(scene.pose, 0.1, 1.0);
    evidence.pose_prior->mean.rotation *= scale;
    EXPECT_NE(message(evidence).find("pose_prior"), std::string::npos);
  }
  EstimationOptions options = LeastSquares();
  options.pose_prior = Around(scene.pose, 0.0, 1.0);
  EXPECT_NE(message(options).find("pose_prior"), std::string::npos);
  options = LeastSquares();
  options.gravity_prior = GravityPrior{};
  options.gravity_prior->sigma_rad = 0.0;
  EXPECT_NE(message(options).find("gravity_prior"), std::string::npos);
  options.gravity_prior = GravityPrior{};
  options.gravity_prior->in_camera *= 2.0;
  EXPECT_NE(message(options).find("gravity_prior"), std::string::npos);
}

// A prediction and a photo, each with its covariance: the estimate is their mean by information,
// and so is its covariance.
TEST(PosePriorTest, EntersTheEstimateAndItsCovariance) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    PlaneScene scene(0.7, 0.3, seed);
    Observations observations = CircleAndAxes(&scene);
    observations.circles[0].radius = 1.0;
    EstimationOptions options = LeastSquares();
    const PoseEstimate photo = Ok(EstimatePose(observations, options));
    const PoseHypothesis& alone = photo.hypotheses[0];
    ASSERT_EQ(alone.rank, 6);
    const Matrix6d C1 = alone.Covariance();
    // As sure as the photo, in other directions.
    Matrix6d C2 = 2.0 * Matrix6d(C1.diagonal().asDiagonal());
    const Eigen::LLT<Matrix6d> llt(C2);
    Vector6d unit;
    for (int k = 0; k < 6; ++k) unit[k] = scene.random.Normal();
    const Vector6d off = llt.matrixL() * unit;
    PosePrior prior;
    prior.mean.rotation = ExpRotation(off.head<3>()) * alone.cam_from_world.rotation;
    prior.mean.translation = alone.cam_from_world.translation + off.tail<3>();
    Eigen::Map<Matrix6d>(prior.covariance.data()) = C2;
    options.pose_prior = prior;
    const PoseHypothesis h = Best(EstimatePose(observations, options));

    const Matrix6d C = (C1.inverse() + C2.inverse()).inverse();
    const Vector6d expected = C * C2.inverse() * off;
    Vector6d moved;
    moved << LogRotation(h.cam_from_world.rotation * alone.cam_from_world.rotation.transpose()),
        h.cam_from_world.translation - alone.cam_from_world.translation;
    // Both in standard deviations of the result: linear to a few hundredths.
    const Eigen::LLT<Matrix6d> scale(C);
    EXPECT_LT(scale.matrixL().solve(moved - expected).norm(), 0.05) << seed;
    const Matrix6d relative =
        scale.matrixL().solve(scale.matrixL().solve(h.Covariance()).transpose());
    EXPECT_LT((relative - Matrix6d::Identity()).norm(), 0.05) << seed;
  }
}

// Between the two poses of a circle it decides by how far it is from each.
TEST(PosePriorTest, EntersTheRanking) {
  PlaneScene scene(0.7, 0.2);
  const Observations observations = OneCircle(&scene);
  const PoseEstimate both = EstimatePose(observations, LeastSquares());
  ASSERT_EQ(both.hypotheses.size(), 2U);
  const double apart = Between(both.hypotheses[0].cam_from_world.rotation.col(2),
                               both.hypotheses[1].cam_from_world.rotation.col(2));
  for (int mean : {0, 1}) {
    const CameraPose& pose = both.hypotheses[static_cast<std::size_t>(mean)].cam_from_world;
    const Vector3d normal = pose.rotation.col(2);
    EstimationOptions options = LeastSquares();
    options.pose_prior = Around(pose, 0.05, 10.0);
    PoseEstimate estimate = EstimatePose(observations, options);
    ASSERT_TRUE(estimate.status.ok()) << estimate.status.message;
    EXPECT_GT(estimate.hypotheses[0].probability, 0.9999);
    EXPECT_LT(Between(estimate.hypotheses[0].cam_from_world.rotation.col(2), normal), 0.01);
    EXPECT_FALSE(estimate.hypotheses[0].RotationIsFree());  // The prior tells the spin.

    const double sigma = 0.4 * apart;
    options.pose_prior = Around(pose, sigma, 10.0);
    estimate = EstimatePose(observations, options);
    ASSERT_EQ(estimate.hypotheses.size(), 2U) << estimate.status.message;
    const PoseHypothesis& near = Nearest(estimate, normal);
    const double odds = std::log(near.probability / (1.0 - near.probability));
    // 3.1 but for the prior's own bend over such an angle.
    EXPECT_NEAR(odds, 0.5 * apart * apart / (sigma * sigma), 0.4);
  }
}

// Where scale and origin are not observed there is no translation to compare with.
TEST(PosePriorTest, TheLengthOfTheTranslationHasNoPartWithoutAScale) {
  PlaneScene scene(0.7, 0.2);
  Observations observations = OneCircle(&scene);
  EstimationOptions options = LeastSquares();
  options.pose_prior = Around(scene.pose, 0.05, 0.5);
  const PoseEstimate estimate = EstimatePose(observations, options);
  options.pose_prior->mean.translation *= 7.0;
  Eigen::Map<Matrix6d>(options.pose_prior->covariance.data()).bottomRightCorner<3, 3>() *= 49.0;
  const PoseEstimate other_unit = EstimatePose(observations, options);
  ASSERT_TRUE(estimate.status.ok() && other_unit.status.ok());
  EXPECT_LT(RotationAngle(estimate.hypotheses[0].cam_from_world.rotation,
                          other_unit.hypotheses[0].cam_from_world.rotation),
            1e-6);
  EXPECT_LT((estimate.hypotheses[0].Covariance() - other_unit.hypotheses[0].Covariance()).norm(),
            1e-6);
}

// Odometry that has slipped.
TEST(PosePriorTest, IsLeftOutWhereThePhotoContradictsIt) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    PlaneScene scene(0.6, 0.3, seed);
    Observations observations = CircleAndAxes(&scene);
    observations.circles[0].radius = 1.0;
    for (const double off : {0.0, 0.2}) {
      EstimationOptions options = LeastSquares();
      options.pose_prior = Around(scene.pose, 0.01, 0.02);
      options.pose_prior->mean.rotation =
          ExpRotation(off * Vector3d(0.6, 0.0, 0.8)) * options.pose_prior->mean.rotation;
      const PoseHypothesis h = Best(EstimatePose(observations, options));
      EXPECT_EQ(h.left_out,
                off > 0.0 ? std::vector<std::string>{"pose_prior"} : std::vector<std::string>());
      EXPECT_LT(RotationAngle(h.cam_from_world.rotation, scene.pose.rotation), 0.02) << seed;
      EXPECT_GT(h.probability, 0.99);
    }
  }
}

// Nothing but the prior tells the turn of circles: where it contradicts them that is free, and they
// say what they say without it.
TEST(PosePriorTest, IsLeftOutWhereItAloneTellsTheTurn) {
  for (std::uint64_t seed = 1; seed <= 10; ++seed) {
    PlaneScene scene(0.6, 0.3, seed);
    Observations one = OneCircle(&scene), many = one;
    for (const auto& [id, x] : {std::pair("c1", -2.2), {"c2", 2.3}})
      many.circles.push_back(scene.Circle(id, x, 0.5, 0.8));
    EstimationOptions options = LeastSquares();
    options.pose_prior = Around(scene.pose, 0.01, 0.02);
    Eigen::Matrix3d& turned = options.pose_prior->mean.rotation;
    turned = ExpRotation(0.4 * Vector3d(0.0, 1.0, 0.0)) * turned;
    for (const Observations& observations : {one, many}) {
      const PoseEstimate estimate = Ok(EstimatePose(observations, options));
      const PoseHypothesis& h = Nearest(estimate, scene.pose.rotation.col(2));
      EXPECT_EQ(h.left_out, std::vector<std::string>{"pose_prior"}) << seed;
      EXPECT_EQ(h.free_directions.size(), 1U) << seed;
      EXPECT_LT(NormalError(h, scene), 0.02) << seed;
      EXPECT_NEAR(h.probability, observations.circles.size() > 1 ? 1.0 : 0.5, 0.01) << seed;
    }
  }
}

}  // namespace
}  // namespace circline
