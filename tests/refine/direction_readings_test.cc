// Pencils whose direction is not certain (PencilObservation::readings).
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "circline/estimators/basics.h"
#include "circline/refine/estimate_pose.h"
#include "tests/basics.h"
#include "tests/plane_scene.h"
#include "tests/refine/simulated_options.h"

namespace circline {
namespace {

using Eigen::Vector3d;

Observations TwoPencils(PlaneScene* scene) {
  Observations observations = scene->Empty();
  observations.pencils = scene->Axes();
  return observations;
}

Vector3d TurnedY(const PlaneScene& scene, double turn_deg) {
  const Eigen::Matrix3d& R = scene.pose.rotation;
  return Eigen::AngleAxisd(turn_deg * kDegree, R.col(0)) * R.col(1);
}

TEST(DirectionReadings, WhatIsFarFromThePoseIsAHypothesisOfItsOwn) {
  PlaneScene scene(0.7, 0.1);
  Observations observations = TwoPencils(&scene);
  observations.pencils[1].readings = {
      {TurnedY(scene, 0.0), 0.6}, {TurnedY(scene, 1.0), 0.1}, {TurnedY(scene, 8.0), 0.3}};
  const PoseEstimate estimate = Ok(EstimatePose(observations));
  ASSERT_EQ(estimate.hypotheses.size(), 2U);
  EXPECT_NEAR(estimate.hypotheses[0].probability, 0.7, 1e-3);
  EXPECT_NEAR(estimate.hypotheses[1].probability, 0.3, 1e-3);
  EXPECT_LT(NormalError(estimate.hypotheses[0], scene), 1.0 * kDegree);
  const Eigen::Matrix3d& turned = estimate.hypotheses[1].cam_from_world.rotation;
  EXPECT_GT(std::abs(turned.col(1).dot(TurnedY(scene, 8.0))), std::cos(1.5 * kDegree));
  EXPECT_GT(std::abs(turned.col(0).dot(scene.pose.rotation.col(0))), std::cos(1.0 * kDegree));
}

TEST(DirectionReadings, CirclesTurnWithThePose) {
  PlaneScene scene(0.7, 0.1);
  Observations observations = TwoPencils(&scene);
  observations.circles = {scene.Circle("c0", 0.5, 0.2, 0.3)};
  observations.frame.origin = scene.Pixel(0.0, 0.0);
  observations.pencils[1].readings = {{TurnedY(scene, 0.0), 0.7}, {TurnedY(scene, 8.0), 0.3}};
  const PoseEstimate estimate = Ok(EstimatePose(observations));
  ASSERT_GE(estimate.hypotheses.size(), 2U);
  for (const PoseHypothesis& h : estimate.hypotheses) {
    ASSERT_EQ(h.circles.size(), 1U);
    EXPECT_GT(std::abs(h.circles[0].normal.dot(h.cam_from_world.rotation.col(2))), 1.0 - 1e-3);
  }
}

// No probability leaves the library that is none.
TEST(DirectionReadings, MustBeProbabilities) {
  PlaneScene scene(0.7, 0.1);
  Observations observations = TwoPencils(&scene);
  for (const double probability : {std::nan(""), -0.1, 1.1}) {
    observations.pencils[1].readings = {{TurnedY(scene, 8.0), probability}};
    const Status status = EstimatePose(observations).status;
    EXPECT_EQ(status.code, StatusCode::kInvalidArgument) << probability << status.message;
  }
  // But for rounding, of a sum of them say.
  observations.pencils[1].readings = {{TurnedY(scene, 8.0), 1.0 + 1e-15}};
  EXPECT_TRUE(EstimatePose(observations).status.ok());
}

TEST(DirectionReadings, WhatIsNearIsTheSamePose) {
  PlaneScene scene(0.7, 0.1);
  Observations observations = TwoPencils(&scene);
  const PoseEstimate before = Ok(EstimatePose(observations));
  observations.pencils[1].readings = {{TurnedY(scene, -1.0), 0.5}, {-TurnedY(scene, 1.0), 0.5}};
  const PoseEstimate after = Ok(EstimatePose(observations));
  ASSERT_EQ(after.hypotheses.size(), before.hypotheses.size());
  EXPECT_EQ(after.hypotheses[0].probability, before.hypotheses[0].probability);
}

// Readings are directions through the camera as it was guessed, poses through the one that was
// found.
TEST(DirectionReadings, AreSeenThroughTheCameraThatWasFound) {
  PlaneScene scene(0.7, 0.1);
  scene.camera.distortion = {};
  Observations observations = TwoPencils(&scene);
  observations.pencils.push_back(scene.Pencil("L3", PencilDirection::kZ, Vector3d::UnitZ()));
  constexpr double kGuess = 1.3;
  observations.camera.fx *= kGuess;
  observations.camera.fy *= kGuess;
  const Vector3d y = TurnedY(scene, 0.0);
  observations.pencils[1].readings = {{Vector3d(y.x(), y.y(), kGuess * y.z()).normalized(), 1.0}};
  EstimationOptions options;
  options.camera_sigma = CameraSigma();
  options.camera_sigma->log_focal = 0.5;
  const PoseEstimate estimate = Ok(EstimatePose(observations, options));
  EXPECT_NEAR(estimate.hypotheses[0].focal_scale, 1.0 / kGuess, 0.1);
  EXPECT_EQ(estimate.hypotheses.size(), 1U);
  EXPECT_LT(NormalError(estimate.hypotheses[0], scene), 2.0 * kDegree);
}

}  // namespace
}  // namespace circline
