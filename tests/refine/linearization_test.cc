#include "circline/refine/joint/linearization.h"

#include <ceres/ceres.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "circline/refine/nearby_solve.h"
#include "tests/plane_scene.h"

namespace circline {
namespace {

// Rings that share centres and radii, and pencils of any direction, of which three are a chain of
// known angles.
Observations RingsAndPencils() {
  PlaneScene scene(0.7, 0.3);
  Observations observations = scene.Empty();
  observations.frame.plane = "p0";
  int ring = 0;
  for (const double x : {-1.5, 0.2, 1.8}) {
    for (const double radius : {0.8, 0.5}) {
      CircleObservation circle = scene.Circle("c" + std::to_string(ring), x, 0.4 * x, radius);
      circle.concentric = "ring" + std::to_string(ring / 2);
      if (radius > 0.6) circle.radius_group = "outer";
      observations.circles.push_back(circle);
      ++ring;
    }
  }
  for (const double angle : {0.2, 0.9, 1.3, 2.1}) {
    observations.pencils.push_back(scene.Pencil("l" + std::to_string(observations.pencils.size()),
                                                PencilDirection::kFree,
                                                {std::cos(angle), std::sin(angle), 0.0}));
  }
  observations.known_angles = {{{"l0", "l1"}, 0.7, 0.002}, {{"l1", "l2"}, 0.4, 0.002}};
  FitDirect(scene.sigma(), &observations);
  return ResolveWorld(observations);
}

// The covariance of the shared unknowns as ceres has it, of the active terms without losses.
class ByCeres {
 public:
  ByCeres(const JointProblem& problem, State* state) : problem_(OwnsNothing()) {
    for (const Term& term : problem.terms()) {
      if (!problem.IsActive(term, *state)) continue;
      std::vector<double*> blocks;
      for (const int index : term.blocks) {
        const Block& block = problem.blocks()[static_cast<std::size_t>(index)];
        double* values = state->x.data() + block.offset;
        blocks.push_back(values);
        if (problem_.HasParameterBlock(values)) continue;
        problem_.AddParameterBlock(values, block.size, block.manifold.get());
        if (block.is_constant) problem_.SetParameterBlockConstant(values);
      }
      problem_.AddResidualBlock(term.cost.get(), nullptr, blocks);
    }
  }

  bool Compute(const std::vector<const double*>& blocks) {
    std::vector<std::pair<const double*, const double*>> pairs;
    for (std::size_t i = 0; i < blocks.size(); ++i) {
      for (std::size_t j = i; j < blocks.size(); ++j) pairs.emplace_back(blocks[i], blocks[j]);
    }
    return covariance_.Compute(pairs, &problem_);
  }

  Eigen::MatrixXd Between(const double* a, const double* b) {
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> out(
        problem_.ParameterBlockTangentSize(a), problem_.ParameterBlockTangentSize(b));
    EXPECT_TRUE(covariance_.GetCovarianceBlockInTangentSpace(a, b, out.data()));
    return out;
  }

 private:
  ceres::Problem problem_;
  ceres::Covariance covariance_{{}};
};

// Whether they are of the core, or have a residual in common.
bool Meet(const JointProblem& problem, int a, int b) {
  if (a <= JointProblem::kCamera || b <= JointProblem::kCamera) return true;
  return std::any_of(problem.terms().begin(), problem.terms().end(), [&](const Term& term) {
    const auto has = [&](int block) {
      return std::find(term.blocks.begin(), term.blocks.end(), block) != term.blocks.end();
    };
    return has(a) && has(b);
  });
}

TEST(Linearization, HasTheCovarianceOfAllUnknownsAtOnce) {
  const Observations resolved = RingsAndPencils();
  EstimationOptions options;
  options.camera_sigma = CameraSigma{0.05, 0.0, 0.0, 0.0, 0.0};
  const JointProblem problem(resolved, options);
  State state;
  const PlaneScene truth(0.7, 0.3);
  ASSERT_TRUE(problem.Start(truth.pose, 0.0, problem.FirstReading(), &state).ok());
  ASSERT_TRUE(problem.Solve(options.max_iterations, &state).ok());
  Linearization at(problem, state, Weighing());
  ASSERT_TRUE(at.ok() && at.ComputeCovariance());

  std::vector<int> blocks = {JointProblem::kRotation, JointProblem::kCamera};
  blocks.insert(blocks.end(), problem.directions().begin(), problem.directions().end());
  for (const JointProblem::CircleBlocks& circle : problem.circles()) {
    for (const int block : {circle.center, circle.radius}) {
      if (at.column(block) >= 0 && std::find(blocks.begin(), blocks.end(), block) == blocks.end())
        blocks.push_back(block);
    }
  }
  std::vector<const double*> values;
  std::vector<std::vector<int>> columns;
  int beyond_the_core = 0;
  for (const int index : blocks) {
    const Block& block = problem.blocks()[static_cast<std::size_t>(index)];
    values.push_back(state.x.data() + block.offset);
    columns.emplace_back();
    for (int k = 0; k < block.tangent_size(); ++k) columns.back().push_back(at.column(index) + k);
    beyond_the_core += at.column(index) >= at.core_size() ? 1 : 0;
  }
  // Four directions; two rings' centres, a radius that ties them, and three of their own.
  EXPECT_EQ(beyond_the_core, 10);
  ByCeres expected(problem, &state);
  ASSERT_TRUE(expected.Compute(values));
  int num_meetings = 0;
  for (std::size_t a = 0; a < blocks.size(); ++a) {
    for (std::size_t b = a; b < blocks.size(); ++b) {
      if (!Meet(problem, blocks[a], blocks[b])) continue;
      ++num_meetings;
      std::vector<int> both = columns[a];
      both.insert(both.end(), columns[b].begin(), columns[b].end());
      const auto rows = static_cast<Eigen::Index>(columns[a].size()),
                 cols = static_cast<Eigen::Index>(columns[b].size());
      const Eigen::MatrixXd given = at.Covariance(both).topRightCorner(rows, cols),
                            wanted = expected.Between(values[a], values[b]);
      const double scale = std::sqrt(expected.Between(values[a], values[a]).diagonal().maxCoeff() *
                                     expected.Between(values[b], values[b]).diagonal().maxCoeff());
      EXPECT_LT((given - wanted).cwiseAbs().maxCoeff(), 1e-6 * scale) << a << " " << b;
    }
  }
  EXPECT_GT(num_meetings, 30);
}

}  // namespace
}  // namespace circline
