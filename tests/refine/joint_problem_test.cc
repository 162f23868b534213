#include "circline/refine/joint/joint_problem.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <initializer_list>

#include "circline/estimators/circle_pose.h"
#include "circline/refine/joint/joint_result.h"
#include "circline/refine/joint/readings.h"
#include "tests/plane_scene.h"
#include "tests/refine/simulated_options.h"

namespace circline {
namespace {

// A ring of which one rim is left out: taken in again, it leaves the other's centre where that has
// it, brings its own radius, and agrees.
TEST(JointProblem, AdmitsARimWithoutMovingTheOthersCentre) {
  PlaneScene scene(0.7, 0.3);
  Observations observations = scene.Empty();
  observations.frame.plane = "p0";
  for (const double radius : {2.0, 1.2}) {
    observations.circles.push_back(scene.Circle(radius > 1.5 ? "out" : "in", 0.5, 0.3, radius));
    observations.circles.back().concentric = "ring";
  }
  FitDirect(scene.sigma(), &observations);
  const Observations resolved = ResolveWorld(observations);
  const EstimationOptions options;
  const JointProblem problem(resolved, options);
  ASSERT_EQ(problem.circles().size(), 2U);
  const JointProblem::CircleBlocks &out = problem.circles()[0], &in = problem.circles()[1];
  ASSERT_EQ(out.center, in.center);
  Reading reading = problem.FirstReading();
  reading[static_cast<std::size_t>(in.feature)] = 0;
  State state;
  ASSERT_TRUE(problem.Start(scene.pose, 0.0, reading, &state).ok());
  ASSERT_TRUE(problem.Solve(options.max_iterations, &state).ok());
  State with = state;
  ASSERT_TRUE(problem.Admit(static_cast<std::size_t>(in.feature), &with));
  const auto at = [&](const State& s, int block, int k) {
    return s
        .x[static_cast<std::size_t>(problem.blocks()[static_cast<std::size_t>(block)].offset + k)];
  };
  for (int k = 0; k < 2; ++k) EXPECT_EQ(at(with, in.center, k), at(state, in.center, k));
  EXPECT_NEAR(at(with, in.radius, 0) / at(with, out.radius, 0), 0.6, 0.01);
  EXPECT_LT(problem.Cost(with) + LeftOutCost(problem, with),
            problem.Cost(state) + LeftOutCost(problem, state));
}

// How many of a photo's features are clutter is not known beforehand: where one kerb is odd,
// another may be.
TEST(JointProblem, LeavingOutASecondLineCostsLessThanTheFirst) {
  PlaneScene scene(0.7, 0.3);
  Observations observations = scene.Empty();
  observations.circles = {scene.Circle("rim", 0.0, 0.0, 1.5, 100)};
  observations.pencils = {scene.Pencil("kerbs", PencilDirection::kX, Eigen::Vector3d::UnitX(), 5)};
  FitDirect(scene.sigma(), &observations);
  const Observations resolved = ResolveWorld(observations);
  const EstimationOptions options;
  const JointProblem problem(resolved, options);
  State state;
  ASSERT_TRUE(problem.Start(scene.pose, 0.0, problem.FirstReading(), &state).ok());
  EXPECT_EQ(LeftOutCost(problem, state), 0.0);
  const auto cost_without = [&](std::initializer_list<std::size_t> lines) {
    State without = state;
    for (const std::size_t line : lines)
      without.active[static_cast<std::size_t>(problem.lines()[line].feature)] = 0;
    return LeftOutCost(problem, without);
  };
  const double first = cost_without({1}), second = cost_without({2}), both = cost_without({1, 2});
  EXPECT_GT(both, std::max(first, second));
  EXPECT_LT(both, first + second - 1.0);
}

// Under a strong lens another focal length bends the same photo otherwise: without noise the fits
// there, and what a refinement starts from, are exact.
TEST(JointProblem, StartsAtAnotherFocalLengthOfAStrongLens) {
  constexpr double kMistake = 1.3, kPrior = 0.5;
  PlaneScene scene(0.8);
  scene.camera.distortion = {-0.4, 0.15, 0.0, 0.0, 0.0};
  Observations observations = scene.Empty();
  observations.frame.plane = "p0";
  observations.circles = {scene.Circle("c", 2.0, 1.5, 1.2, 100)};
  observations.circles[0].center = scene.Pixel(2.0, 1.5);
  observations.circles[0].sigma_px = 0.3;
  observations.camera.fx *= kMistake;
  observations.camera.fy *= kMistake;
  FitDirect(scene.sigma(), &observations);
  const Observations resolved = ResolveWorld(observations);
  EstimationOptions options = Exact();
  options.camera_sigma = CameraSigma::Exact();
  options.camera_sigma->log_focal = kPrior;
  const JointProblem problem(resolved, options);

  const double back = -std::log(kMistake);
  std::array<CirclePose, 2> poses;
  ASSERT_EQ(CirclePoses(Refocused(problem, back).circles[0].fit->conic, &poses), 2);
  const Eigen::Vector3d normal = scene.pose.rotation.col(2);
  EXPECT_LT(std::min(poses[0].normal.cross(normal).norm(), poses[1].normal.cross(normal).norm()),
            1e-6);
  State state;
  ASSERT_TRUE(problem.Start(scene.pose, back, problem.FirstReading(), &state).ok());
  EXPECT_NEAR(state.cost, 0.5 * std::pow(back / kPrior, 2), 1e-6);  // Of the prior alone.
}

}  // namespace
}  // namespace circline
