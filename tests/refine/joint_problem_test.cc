#include "circline/refine/joint/joint_problem.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cstddef>
#include <initializer_list>

#include "circline/refine/joint/joint_result.h"
#include "tests/plane_scene.h"

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

}  // namespace
}  // namespace circline
