// What makes hypotheses comparable, and what the noise is taken to be.
#include "circline/refine/joint_problem.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "tests/plane_scene.h"

namespace circline {
namespace {

// Two circles; the second one's contour scattered where it is not to be explained.
Refined RefineTwo(bool second_is_wrong, double sigma_px) {
  PlaneScene scene(0.6, 0.0);
  Observations observations = scene.Empty();
  observations.circles = {scene.Circle("c0", -1.0, 0.2, 1.0),
                          scene.Circle("c1", 1.5, 0.5, 0.8, 12)};
  FitDirect(sigma_px, &observations);
  for (CircleObservation& circle : observations.circles) circle.sigma_px = sigma_px;
  if (second_is_wrong) {
    Random random(3);
    for (Eigen::Vector2d& p : observations.circles[1].points) {
      const double dx = random.Uniform(-60.0, 60.0), dy = random.Uniform(-60.0, 60.0);
      p += Eigen::Vector2d(dx, dy);
    }
    // As a robust fit marks them: it found hardly any inliers.
    observations.circles[1].inliers.assign(12, 0);
    std::fill_n(observations.circles[1].inliers.begin(), 6, 1);
  }
  observations = ResolveWorld(observations);
  EstimationOptions options;
  options.conic_loss.type = LossType::kTukey;
  const JointProblem problem(observations, options, {sigma_px, sigma_px});
  Approach approach;
  Refined refined;
  EXPECT_TRUE(problem.ApproachFrom(scene.pose, &approach).ok());
  EXPECT_TRUE(problem.Refine(approach, &refined).ok());
  return refined;
}

// Noise k times as wide widens every standard deviation by k. Two hypotheses of which one leaves a
// circle out hold different numbers of unknowns, so that their log determinants drift apart with
// it; on what both explain they do not.
TEST(LogDetTest, HypothesesCompareOnWhatBothExplain) {
  const Refined both[2] = {RefineTwo(false, 0.05), RefineTwo(false, 0.1)};
  const Refined one[2] = {RefineTwo(true, 0.05), RefineTwo(true, 0.1)};
  const std::vector<std::uint8_t> none = {0, 0}, second = {0, 1};
  for (const Refined& r : both) ASSERT_EQ(r.left_out, none);
  for (const Refined& r : one) ASSERT_EQ(r.left_out, second);
  const auto drift = [&](const std::vector<std::uint8_t>& of_both) {
    return (LogDet(both[1], of_both) - LogDet(one[1], second)) -
           (LogDet(both[0], of_both) - LogDet(one[0], second));
  };
  EXPECT_NEAR(drift(second), 0.0, 1e-3);
  EXPECT_NEAR(drift(none), 3.0 * 2.0 * std::log(2.0), 1e-3);  // Centre and radius of the second.
}

// Two circles of which each fits perfectly, on planes that differ by 0.05 rad, said to be one.
Observations NotQuiteFlat(double sigma_px, double lean) {
  PlaneScene scene(0.6, 0.1);
  PlaneScene leaning = scene;
  leaning.pose.rotation = ExpRotation({lean, 0.0, 0.0}) * scene.pose.rotation;
  Observations observations = scene.Empty();
  observations.circles = {scene.Circle("c0", -1.4, 0.2, 1.2), leaning.Circle("c1", 1.4, 0.2, 1.2)};
  for (CircleObservation& circle : observations.circles) circle.sigma_px = sigma_px;
  return observations;
}

double NormalSigma(const Observations& observations) {
  EstimationOptions options;
  options.contour_bias_px = 0.0;
  const PoseEstimate estimate = EstimatePose(observations, options);
  EXPECT_TRUE(estimate.status.ok()) << estimate.status.message;
  return std::sqrt(estimate.hypotheses[0].Covariance().topLeftCorner<3, 3>().trace());
}

// What features disagree by counts as noise where that is automatic; a stated sigma is a fact.
TEST(NoiseTest, DisagreementRaisesAutomaticScalesAndNoStatedOnes) {
  constexpr double kLean = 0.15;
  const double flat = NormalSigma(NotQuiteFlat(0.1, 0.0));
  EXPECT_NEAR(NormalSigma(NotQuiteFlat(0.0, 0.0)), flat, 0.2 * flat);
  EXPECT_GT(NormalSigma(NotQuiteFlat(0.0, kLean)), 2.0 * flat);
  // The covariance counts inliers only: what disagrees most may be missing from it, no more.
  EXPECT_LT(NormalSigma(NotQuiteFlat(0.1, kLean)), 2.0 * flat);
}

}  // namespace
}  // namespace circline
