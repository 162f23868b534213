// On the paper's scene the refined solvers sit on the Cramer-Rao bound, and say so themselves.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "circline/estimators/closed_form_solvers.h"
#include "circline/refine/refined_solvers.h"
#include "tests/paper_scene.h"

namespace circline {
namespace {

struct Efficiency {
  double rms_rad = 0.0;  // Total rotation angle.
  double nees = 0.0;     // Mean over trials; 3 is honest.
};

Efficiency Measure(const std::string& name, SolverStage stage, LossType loss, double sigma_px,
                   int trials, EstimationOptions options = {}) {
  options.conic_loss.type = options.line_loss.type = loss;
  SolverRegistry registry;
  AddClosedFormSolvers(&registry);
  AddRefinedSolvers(&registry, options);
  const Solver* solver = registry.Find(name, stage);
  Efficiency result;
  Random random(7);
  for (int i = 0; i < trials; ++i) {
    const PoseEstimate estimate = solver->Solve(PaperScene(sigma_px, &random));
    EXPECT_TRUE(estimate.status.ok()) << name << ": " << estimate.status.message;
    if (!estimate.status.ok()) return result;
    const PoseHypothesis& best = estimate.hypotheses.front();
    const Eigen::Vector3d error =
        LogRotation(PaperPose().rotation * best.cam_from_world.rotation.transpose());
    result.rms_rad += error.squaredNorm() / trials;
    const Eigen::Matrix3d covariance = best.Covariance().topLeftCorner<3, 3>();
    result.nees += error.dot(covariance.inverse() * error) / trials;
  }
  result.rms_rad = std::sqrt(result.rms_rad);
  return result;
}

// 200 trials: the rms of three components scatters by 4 %, the mean NEES by 0.17.
constexpr int kTrials = 200;

TEST(EfficiencyTest, JointIsWithinTenPercentOfTheBound) {
  const Efficiency e = Measure("joint", SolverStage::kRefined, LossType::kTrivial, 1.0, kTrials);
  EXPECT_LT(e.rms_rad, 1.10 * kBoundJoint);
  EXPECT_GT(e.rms_rad, 0.90 * kBoundJoint);
  EXPECT_NEAR(e.nees, 3.0, 0.5);
}

TEST(EfficiencyTest, JointWithRobustLossIsWithinTenPercentOfTheBound) {
  const Efficiency e = Measure("joint", SolverStage::kRefined, LossType::kCauchy, 1.0, kTrials);
  EXPECT_LT(e.rms_rad, 1.10 * kBoundJoint);
  EXPECT_NEAR(e.nees, 3.0, 0.5);
}

TEST(EfficiencyTest, JointWithOrthogonalDistancesIsWithinTenPercentOfTheBound) {
  EstimationOptions options;
  options.conic_distance = ConicDistanceType::kOrthogonal;
  const Efficiency e =
      Measure("joint", SolverStage::kRefined, LossType::kTrivial, 1.0, kTrials, options);
  EXPECT_LT(e.rms_rad, 1.10 * kBoundJoint);
  EXPECT_GT(e.rms_rad, 0.90 * kBoundJoint);
  EXPECT_NEAR(e.nees, 3.0, 0.5);
}

TEST(EfficiencyTest, CircleFrameIsWithinTenPercentOfTheBound) {
  const Efficiency e =
      Measure("circle_frame", SolverStage::kRefined, LossType::kTrivial, 1.0, kTrials);
  EXPECT_LT(e.rms_rad, 1.10 * kBoundCircleFrame);
  EXPECT_GT(e.rms_rad, 0.90 * kBoundCircleFrame);
  EXPECT_NEAR(e.nees, 3.0, 0.5);
}

TEST(EfficiencyTest, LinePairsIsWithinTenPercentOfTheBound) {
  const Efficiency e =
      Measure("line_pairs", SolverStage::kRefined, LossType::kTrivial, 1.0, kTrials);
  EXPECT_LT(e.rms_rad, 1.10 * kBoundLines);
  EXPECT_GT(e.rms_rad, 0.90 * kBoundLines);
  EXPECT_NEAR(e.nees, 3.0, 0.5);
}

TEST(EfficiencyTest, ClosedFormsReachThePapersAccuracy) {
  // METHOD section 4, 1 px: 0.0053 for algorithm 1, 0.0139 for algorithm 2.
  EXPECT_LT(
      Measure("circle_frame", SolverStage::kClosedForm, LossType::kTrivial, 1.0, kTrials).rms_rad,
      0.0058);
  EXPECT_LT(
      Measure("line_pairs", SolverStage::kClosedForm, LossType::kTrivial, 1.0, kTrials).rms_rad,
      0.0139);
}

TEST(EfficiencyTest, NoiseFreeScenesAreExact) {
  for (const char* name : {"circle_frame", "line_pairs", "joint"}) {
    EXPECT_LT(Measure(name, SolverStage::kRefined, LossType::kTrivial, 0.0, 1).rms_rad, 1e-9)
        << name;
  }
  for (const char* name : {"circle_frame", "line_pairs"}) {
    EXPECT_LT(Measure(name, SolverStage::kClosedForm, LossType::kTrivial, 0.0, 1).rms_rad, 1e-9)
        << name;
  }
}

}  // namespace
}  // namespace circline
