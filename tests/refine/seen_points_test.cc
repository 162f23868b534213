#include "circline/refine/joint/seen_points.h"

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "circline/estimators/pose.h"
#include "circline/refine/nearby_solve.h"
#include "tests/plane_scene.h"

namespace circline {
namespace {

// Three circles of one known size, the last one with its centre marked, and a prior of the pose,
// through a camera of which little is known.
class SeenPointsTest : public ::testing::Test {
 protected:
  SeenPointsTest() : scene_(0.7, 0.3), observations_(scene_.Empty()) {
    observations_.frame.plane = "p0";
    for (const double x : {-1.5, 0.4, 2.0})
      observations_.circles.push_back(scene_.Circle("c" + std::to_string(x), x, 0.3 * x, 0.8));
    for (CircleObservation& circle : observations_.circles) circle.radius = 0.8;
    observations_.circles.back().center = scene_.Pixel(2.0, 0.6);
    FitDirect(scene_.sigma(), &observations_);
    observations_ = ResolveWorld(observations_);
    CameraSigma& camera = options_.camera_sigma.emplace();
    camera.log_focal = 0.5;
    camera.log_aspect = 0.01;
    camera.principal_point_px = 20.0;
    PosePrior& prior = options_.pose_prior.emplace();
    prior.mean = {scene_.pose.rotation * ExpRotation({0.05, -0.03, 0.02}),
                  scene_.pose.translation + Eigen::Vector3d(0.1, -0.05, 0.2)};
    Eigen::Map<Eigen::Matrix<double, 6, 6>>(prior.covariance.data()).diagonal().setConstant(0.04);
  }
  // Off the minimum.
  State Start(const JointProblem& problem) const {
    State state;
    EXPECT_TRUE(problem.Start(scene_.pose, 0.1, problem.FirstReading(), &state).ok());
    double* camera = problem.At(JointProblem::kCamera, &state);
    camera[1] = 0.003;
    camera[2] = 7.0;
    camera[3] = -4.0;
    return state;
  }

  PlaneScene scene_;
  Observations observations_;
  EstimationOptions options_;
};

TEST_F(SeenPointsTest, ComeBackToWhereTheyWere) {
  const JointProblem problem(observations_, options_);
  State state = Start(problem);
  const std::vector<double> before = state.x;
  {
    const SeenPoints seen(problem, &state);
    EXPECT_NE(state.x, before);
  }
  for (std::size_t i = 0; i < before.size(); ++i) EXPECT_NEAR(state.x[i], before[i], 1e-12) << i;
}

TEST_F(SeenPointsTest, CostAndDerivativesAreThoseOfThePlaces) {
  const JointProblem problem(observations_, options_);
  State state = Start(problem);
  const double cost_of_places = problem.Cost(state);
  SeenPoints seen(problem, &state);
  ceres::Problem images(OwnsNothing());
  EXPECT_GT(seen.Fill(&images), 0);
  std::vector<double*> blocks;
  images.GetParameterBlocks(&blocks);
  blocks.erase(
      std::remove_if(blocks.begin(), blocks.end(),
                     [&](const double* block) { return images.IsParameterBlockConstant(block); }),
      blocks.end());
  ceres::Problem::EvaluateOptions all;
  all.parameter_blocks = blocks;
  double cost = 0.0;
  std::vector<double> gradient;
  ASSERT_TRUE(images.Evaluate(all, &cost, nullptr, &gradient, nullptr));
  EXPECT_NEAR(cost, cost_of_places, 1e-9 * cost_of_places);
  std::size_t at = 0;
  for (double* block : blocks) {
    const ceres::Manifold* manifold = images.GetManifold(block);
    const int ambient = images.ParameterBlockSize(block);
    const int tangent = images.ParameterBlockTangentSize(block);
    const Eigen::VectorXd x = Eigen::Map<const Eigen::VectorXd>(block, ambient);
    for (int k = 0; k < tangent; ++k, ++at) {
      constexpr double kStep = 1e-6;
      double costs[2];
      for (const int side : {0, 1}) {
        const Eigen::VectorXd delta =
            (side == 0 ? -kStep : kStep) * Eigen::VectorXd::Unit(tangent, k);
        if (manifold != nullptr) {
          manifold->Plus(x.data(), delta.data(), block);
        } else {
          Eigen::Map<Eigen::VectorXd>(block, ambient) = x + delta;
        }
        ASSERT_TRUE(images.Evaluate(all, &costs[side], nullptr, nullptr, nullptr));
        Eigen::Map<Eigen::VectorXd>(block, ambient) = x;
      }
      const double by_differences = (costs[1] - costs[0]) / (2.0 * kStep);
      EXPECT_NEAR(gradient[at], by_differences, 1e-4 * std::abs(by_differences) + 0.05)
          << "block of " << ambient << ", " << k;
    }
  }
  EXPECT_EQ(at, gradient.size());
}

// The three tell the focal length, whether two thirds of it or half as much again is guessed.
TEST_F(SeenPointsTest, LeadToOneMinimum) {
  const JointProblem problem(observations_, options_);
  std::vector<State> found;
  for (const double log_focal : {-0.4, 0.0, 0.4}) {
    State& state = found.emplace_back();
    ASSERT_TRUE(problem.Start(scene_.pose, log_focal, problem.FirstReading(), &state).ok());
    ASSERT_TRUE(problem.SolveGraduated(options_.max_iterations, &state).ok());
  }
  for (const State& state : found) {
    EXPECT_NEAR(state.cost, found[0].cost, 0.01);
    EXPECT_NEAR(problem.LogFocalAt(state), problem.LogFocalAt(found[0]), 0.01);
  }
}

}  // namespace
}  // namespace circline
