#include "circline/refine/joint_problem.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include "circline/refine/joint_result.h"
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

}  // namespace
}  // namespace circline
