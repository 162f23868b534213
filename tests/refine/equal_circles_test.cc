// Circles of equal, unknown radii: on the bound of what that knowledge is worth.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "circline/estimators/circle_pose.h"
#include "circline/refine/estimate_pose.h"
#include "tests/plane_scene.h"
#include "tests/refine/simulated_options.h"
#include "tests/trials.h"

namespace circline {
namespace {

constexpr double kSigmaPx = 0.2;
const std::vector<Eigen::Vector2d>& Centers() {
  static const std::vector<Eigen::Vector2d> centers = {
      {-2.0, -1.5}, {2.0, -1.5}, {0.0, 0.0}, {-2.0, 1.5}, {2.0, 1.5}};
  return centers;
}
constexpr double kRadius = 0.5;

Observations Dots(PlaneScene* scene, bool equal) {
  Observations observations = scene->Empty();
  for (const Eigen::Vector2d& c : Centers()) {
    const std::string id = "c" + std::to_string(observations.circles.size());
    observations.circles.push_back(scene->Circle(id, c.x(), c.y(), kRadius));
    if (equal) observations.circles.back().radius_group = "dots";
  }
  return observations;
}

// Signed distances of the exact contours' points to the images of the circles after a step: the
// plane turned by two angles, each centre moved, the radii changed (together or each).
Eigen::VectorXd Distances(const PlaneScene& exact,
                          const std::vector<std::vector<CalibratedPoint>>& contours, bool equal,
                          const Eigen::VectorXd& step) {
  CameraPose turned = exact.pose;
  turned.rotation = exact.pose.rotation * ExpRotation({step[0], step[1], 0.0});
  std::vector<double> distances;
  for (std::size_t i = 0; i < contours.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(2 + 2 * i);
    const auto radius = static_cast<Eigen::Index>(2 + 2 * contours.size() + (equal ? 0 : i));
    const Eigen::Vector2d center = Centers()[i] + step.segment<2>(at);
    CirclePose circle;
    circle.normal = turned.rotation.col(2);
    circle.center =
        turned.rotation * Eigen::Vector3d(center.x(), center.y(), 0.0) + turned.translation;
    circle.center /= kRadius + step[radius];
    const Eigen::Matrix3d image = ProjectCircle(circle);
    for (const CalibratedPoint& p : contours[i]) distances.push_back(ConicDistancePx(p, image));
  }
  return Eigen::Map<Eigen::VectorXd>(distances.data(), static_cast<Eigen::Index>(distances.size()));
}

// Cramer-Rao bound of the normal: root of the variances of its two angles.
double Bound(bool equal) {
  PlaneScene exact(0.6, 0.0);
  const Observations observations = Dots(&exact, equal);
  std::vector<std::vector<CalibratedPoint>> sets(observations.circles.size());
  for (std::size_t i = 0; i < sets.size(); ++i)
    PixelsToCalibrated(exact.camera, observations.circles[i].points, &sets[i]);
  const auto unknowns = static_cast<Eigen::Index>(2 + 2 * sets.size() + (equal ? 1 : sets.size()));
  Eigen::MatrixXd J(static_cast<Eigen::Index>(60 * sets.size()), unknowns);
  for (Eigen::Index k = 0; k < unknowns; ++k) {
    constexpr double kStep = 1e-6;
    const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(unknowns, k);
    J.col(k) = (Distances(exact, sets, equal, step) - Distances(exact, sets, equal, -step)) /
               (2.0 * kStep * kSigmaPx);
  }
  const Eigen::MatrixXd covariance = (J.transpose() * J).inverse();
  return std::sqrt(covariance.topLeftCorner<2, 2>().trace());
}

TEST(EqualCirclesTest, NormalSitsOnItsBound) {
  constexpr int kTrials = Trials(300);
  double rms[2] = {}, bound[2] = {}, nees = 0.0;
  for (const bool equal : {false, true}) {
    bound[equal ? 1 : 0] = Bound(equal);
    for (int i = 0; i < kTrials; ++i) {
      PlaneScene scene(0.6, kSigmaPx, static_cast<std::uint64_t>(i + 1));
      EstimationOptions options = Exact();
      options.conic_loss.type = LossType::kTrivial;
      const PoseHypothesis best = Best(EstimatePose(Dots(&scene, equal), options));
      const double error = NormalError(best, scene);
      rms[equal ? 1 : 0] += error * error / kTrials;
      nees += equal ? NormalErrors(best, scene.pose).Nees() / kTrials : 0.0;
    }
  }
  if (kSanitized) return;
  for (double& r : rms) r = std::sqrt(r);
  std::printf(
      "five circles: rms of the normal %.5f rad (bound %.5f); known to be equal %.5f (bound "
      "%.5f), NEES %.2f\n",
      rms[0], bound[0], rms[1], bound[1], nees);
  // 300 trials: the rms of two numbers scatters by 3 %, their mean NEES by 0.12.
  EXPECT_NEAR(rms[0] / bound[0], 1.0, 0.08);
  EXPECT_NEAR(rms[1] / bound[1], 1.0, 0.08);
  EXPECT_NEAR(nees, 2.0, 0.35);
  EXPECT_LT(rms[1], 0.8 * rms[0]);
}

// Seen from afar every circle alone has two planes; the farther ones being smaller tells which.
TEST(EqualCirclesTest, TheSizesTellThePlane) {
  for (int i = 0; i < 20; ++i) {
    PlaneScene scene(0.5, 0.3, static_cast<std::uint64_t>(i + 1));
    scene.pose.translation.z() = 30.0;
    const PoseHypothesis best = Best(EstimatePose(Dots(&scene, true), Exact()));
    EXPECT_LT(NormalError(best, scene), 0.1);
    ASSERT_EQ(best.circles.size(), 5U);
    for (const CircleEstimate& circle : best.circles)
      EXPECT_DOUBLE_EQ(circle.radius, best.circles[0].radius);
  }
}

TEST(EqualCirclesTest, OneKnownRadiusIsThatOfTheGroup) {
  PlaneScene scene(0.6, 0.0);
  Observations observations = Dots(&scene, true);
  observations.circles[3].radius = kRadius;
  const PoseHypothesis best = Best(EstimatePose(observations, Exact()));
  EXPECT_TRUE(best.metric);
  EXPECT_NEAR(best.circles[0].radius, kRadius, 1e-9);
  observations.circles[1].radius = 2.0 * kRadius;
  EXPECT_NE(observations.Validate().message.find("radius group 'dots'"), std::string::npos);
}

// One size has one standard deviation, whichever circle states it.
TEST(EqualCirclesTest, TheOrderOfStatedRadiiDoesNotMatter) {
  PlaneScene scene(0.6, kSigmaPx);
  Observations observations = Dots(&scene, true);
  for (CircleObservation& circle : observations.circles) circle.radius = kRadius;
  observations.circles[1].radius_sigma = 0.01;
  observations.circles[3].radius_sigma = 0.1;
  Observations reversed = observations;
  std::reverse(reversed.circles.begin(), reversed.circles.end());
  for (const Observations* some : {&observations, &reversed}) {
    for (const CircleObservation& circle : ResolveWorld(*some).circles)
      EXPECT_EQ(circle.radius_sigma, 0.01) << circle.id;
  }
  // The translation is to the origin, which is the first circle's centre unless it is said.
  observations.frame.origin_is_center = reversed.frame.origin_is_center = "c2";
  const EstimationOptions options;
  const PoseHypothesis a = Best(EstimatePose(observations, options)),
                       b = Best(EstimatePose(reversed, options));
  const double sigma = std::sqrt(a.Covariance().bottomRightCorner<3, 3>().trace());
  EXPECT_NEAR(std::sqrt(b.Covariance().bottomRightCorner<3, 3>().trace()) / sigma, 1.0, 1e-3);
  EXPECT_NEAR(sigma / a.cam_from_world.translation.norm(), 0.01, 2e-3);
}

}  // namespace
}  // namespace circline
