// Circles: rings against their Cramer-Rao bound, and whether the probabilities of the two poses of
// a circle mean what they say. CIRCLINE_AMBIGUITY_SCENES sets the number of scenes for the latter.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/circle_pose.h"
#include "circline/estimators/random.h"
#include "circline/refine/estimate_pose.h"
#include "tests/pinhole_camera.h"
#include "tests/refine/simulated_options.h"
#include "tests/trials.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// A circle of radius 1 somewhere in the photo, tilted by `tilt` against the line of sight.
CirclePose RandomCircle(double distance, double tilt, Random* random) {
  CirclePose circle;
  const Vector3d sight =
      Vector3d{random->Uniform(-0.25, 0.25), random->Uniform(-0.18, 0.18), 1.0}.normalized();
  circle.center = distance * sight;
  const Vector3d a = sight.unitOrthogonal(), b = sight.cross(a);
  const double spin = random->Uniform(0.0, 2.0 * kPi);
  circle.normal =
      -std::cos(tilt) * sight + std::sin(tilt) * (std::cos(spin) * a + std::sin(spin) * b);
  return circle;
}

Vector2d Noisy(const Vector2d& pixel, double sigma_px, Random* random) {
  const double dx = random->Normal(), dy = random->Normal();
  return pixel + sigma_px * Vector2d(dx, dy);
}

CircleObservation Observe(const Camera& camera, const CirclePose& circle, double radius, int points,
                          double sigma_px, Random* random) {
  CircleObservation observation;
  observation.plane = "p0";
  observation.sigma_px = sigma_px;
  const Vector3d x = circle.normal.unitOrthogonal(), y = circle.normal.cross(x);
  for (int i = 0; i < points; ++i) {
    const double t = 2.0 * kPi * i / points;
    Vector2d pixel;
    EXPECT_TRUE(CameraToPixel(camera, circle.center + radius * (std::cos(t) * x + std::sin(t) * y),
                              &pixel));
    observation.points.push_back(Noisy(pixel, sigma_px, random));
  }
  return observation;
}

// Covariance of the normal (its two tangent components) from noisy points on rings of the given
// radii about one centre. Unknown: the normal, the centre in units of the distance, the radii.
Eigen::Matrix2d NormalBound(const Camera& camera, const CirclePose& truth,
                            const std::vector<double>& radii, int points, double sigma_px) {
  const auto parameters = static_cast<Eigen::Index>(4 + radii.size());
  const Vector3d a = truth.normal.unitOrthogonal(), b = truth.normal.cross(a);
  // Image of ring k after a step: normal along a and b, centre along x and y, radius.
  const auto conic = [&](std::size_t k, const Eigen::VectorXd& step) {
    CirclePose moved;
    moved.normal = (truth.normal + step[0] * a + step[1] * b).normalized();
    moved.center = truth.center + Vector3d(step[2], step[3], 0.0);
    moved.center /= radii[k] + step[4 + static_cast<Eigen::Index>(k)];
    return ProjectCircle(moved);
  };
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(parameters, parameters);
  Random none(1);
  for (std::size_t k = 0; k < radii.size(); ++k) {
    std::vector<CalibratedPoint> exact;
    PixelsToCalibrated(camera, Observe(camera, truth, radii[k], points, 0.0, &none).points, &exact);
    for (const CalibratedPoint& p : exact) {
      Eigen::VectorXd j(parameters);
      for (Eigen::Index i = 0; i < parameters; ++i) {
        constexpr double kStep = 1e-6;
        const Eigen::VectorXd step = kStep * Eigen::VectorXd::Unit(parameters, i);
        j[i] = (ConicDistancePx(p, conic(k, step)) - ConicDistancePx(p, conic(k, -step))) /
               (2.0 * kStep * sigma_px);
      }
      information += j * j.transpose();
    }
  }
  return information.inverse().topLeftCorner<2, 2>();
}

// Two rings, the inner one 0.6 of the outer: the joint estimate sits on the bound of both together.
TEST(RingsTest, NormalSitsOnTheBoundOfBothRings) {
  const Camera camera = PinholeCamera();
  const std::vector<double> radii = {1.0, 0.6};
  constexpr double kSigmaPx = 0.5;
  constexpr int kTrials = Trials(1000), kPoints = 100;
  Random random(31);
  double square = 0.0, bound = 0.0;
  for (int i = 0; i < kTrials; ++i) {
    const double distance = random.Uniform(5.0, 12.0), tilt = random.Uniform(0.5, 1.1);
    const CirclePose truth = RandomCircle(distance, tilt, &random);
    Observations observations;
    observations.camera = camera;
    for (const double radius : radii) {
      CircleObservation ring = Observe(camera, truth, radius, kPoints, kSigmaPx, &random);
      ring.id = radius == 1.0 ? "outer" : "inner";
      ring.concentric = "g0";
      observations.circles.push_back(ring);
    }
    const PoseEstimate estimate = Ok(EstimatePose(observations, LeastSquares()));
    // The better of the two poses: which one it is, is the other test's business.
    double best = 4.0;
    for (const PoseHypothesis& h : estimate.hypotheses) {
      best = std::min(best, (h.cam_from_world.rotation.col(2) - truth.normal).squaredNorm());
    }
    square += best / kTrials;
    bound += NormalBound(camera, truth, radii, kPoints, kSigmaPx).trace() / kTrials;
  }
  if (kSanitized) return;
  std::printf("two rings: rms of the normal %.3f degrees, bound %.3f, ratio %.3f\n",
              std::sqrt(square) / kDegree, std::sqrt(bound) / kDegree, std::sqrt(square / bound));
  EXPECT_LE(std::sqrt(square / bound), 1.05);
}

struct Bin {
  double low, high;
  int scenes = 0, right = 0;
  double probability = 0.0;
};

// A circle, and its centre measured as well as a point of the contour: near and large it decides,
// far away it does not. The stated probability of the first pose is how often it is the right one.
TEST(AmbiguityTest, ProbabilitiesAreCalibrated) {
  const Camera camera = PinholeCamera();
  Random random(32);
  std::array<Bin, 6> bins = {
      {{0.5, 0.6}, {0.6, 0.75}, {0.75, 0.9}, {0.9, 0.97}, {0.97, 0.997}, {0.997, 1.01}}};
  const int scenes = Trials("CIRCLINE_AMBIGUITY_SCENES", 1500);
  int lost = 0;
  for (int i = 0; i < scenes; ++i) {
    const double sigma = random.Uniform(0.1, 1.0);
    const double distance = 4.0 * std::pow(10.0, random.Uniform());
    const double tilt = random.Uniform(0.2, 1.3);
    const CirclePose truth = RandomCircle(distance, tilt, &random);
    CircleObservation circle = Observe(camera, truth, 1.0, 60, sigma, &random);
    circle.id = "c0";
    Vector2d center;
    ASSERT_TRUE(CameraToPixel(camera, truth.center, &center));
    circle.center = Noisy(center, sigma, &random);
    Observations observations;
    observations.camera = camera;
    observations.circles = {circle};
    const PoseEstimate estimate = Ok(EstimatePose(observations, LeastSquares()));
    const auto error = [&](const PoseHypothesis& h) {
      return std::acos(std::min(1.0, h.cam_from_world.rotation.col(2).dot(truth.normal)));
    };
    const auto nearest = std::min_element(
        estimate.hypotheses.begin(), estimate.hypotheses.end(),
        [&](const PoseHypothesis& a, const PoseHypothesis& b) { return error(a) < error(b); });
    // Among the two: within five of its own standard deviations (the spin carries none).
    const double sigma_normal = std::sqrt(nearest->Covariance().topLeftCorner<3, 3>().trace());
    if (error(*nearest) > 5.0 * sigma_normal) ++lost;
    // Where a reading without the centre has the pose too it is twice among the hypotheses.
    const PoseHypothesis& first = estimate.hypotheses.front();
    const bool is_first = nearest == estimate.hypotheses.begin() ||
                          (nearest->left_out != first.left_out &&
                           first.cam_from_world.rotation.col(2)
                                   .cross(nearest->cam_from_world.rotation.col(2))
                                   .norm() < 2.0 * sigma_normal);
    const double p = first.probability;
    for (Bin& bin : bins) {
      if (p < bin.low || p >= bin.high) continue;
      ++bin.scenes;
      bin.probability += p;
      bin.right += is_first ? 1 : 0;
    }
  }
  if (kSanitized) return;
  std::printf("stated probability of the first pose, scenes, how often it is right\n");
  for (const Bin& bin : bins) {
    if (bin.scenes == 0) continue;
    const double stated = bin.probability / bin.scenes;
    const double right = static_cast<double>(bin.right) / bin.scenes;
    std::printf("  %.4f  %6d  %.4f\n", stated, bin.scenes, right);
    // Four standard deviations of the count.
    EXPECT_NEAR(right, stated,
                4.0 * std::sqrt(stated * (1.0 - stated) / bin.scenes) + 1.0 / bin.scenes);
  }
  std::printf("  the truth is not among the hypotheses in %d of %d\n", lost, scenes);
  EXPECT_LE(lost, scenes / 1000);
  const Bin& sure = bins.back();
  EXPECT_GE(sure.right, 0.997 * sure.scenes - 1.0);
}

// Part of a contour is an ellipse seen from two sides, as the whole is, though it knows the one
// pose's tilt by far better than the other's.
TEST(AmbiguityTest, AnArcHasTwoPosesOfOneHalf) {
  const Camera camera = PinholeCamera();
  Random random(7);
  int told = 0;
  constexpr int kScenes = Trials(100);
  for (int i = 0; i < kScenes; ++i) {
    const double distance = random.Uniform(1.5, 5.0), tilt = random.Uniform(0.4, 1.2);
    const CirclePose truth = RandomCircle(distance, tilt, &random);
    CircleObservation arc = Observe(camera, truth, 1.0, 200, 0.2, &random);
    arc.points.resize(i % 2 == 0 ? 50 : 80);
    if (i % 4 < 2) arc.radius = 1.0;
    Observations observations;
    observations.camera = camera;
    observations.circles = {arc};
    const PoseEstimate estimate = Ok(EstimatePose(observations, LeastSquares()));
    if (estimate.hypotheses.size() != 2) continue;
    ++told;
    EXPECT_NEAR(estimate.hypotheses[0].probability, 0.5, 0.02) << i;
  }
  EXPECT_GE(told, 0.9 * kScenes);
}

}  // namespace
}  // namespace circline
