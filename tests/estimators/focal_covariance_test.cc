// What the closed forms for the focal length say of their own errors.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "circline/estimators/basics.h"
#include "circline/estimators/circle_focal.h"
#include "circline/estimators/focal_length.h"
#include "circline/estimators/plane_focal.h"
#include "circline/estimators/random.h"
#include "tests/estimators/focal_scene.h"
#include "tests/trials.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// Normalised squared errors of log f, of the solution nearest to the truth.
class Nees {
 public:
  void Add(int count, const FocalSolution* solutions, double truth) {
    double best = 1e9, nees = 0.0;
    for (int i = 0; i < count; ++i) {
      const FocalSolution& s = solutions[i];
      const double error = std::log(s.focal / truth);
      if (std::abs(error) < best) best = std::abs(error), nees = error * error / s.variance;
      sigma_ += std::sqrt(s.variance) / count;
    }
    trials_ += 1;
    answered_ += count > 0 ? 1 : 0;
    sum_ += nees;
  }
  void Expect(const char* name) const {
    if (kSanitized) return;
    std::printf("%-28s answered %.3f NEES %.3f mean sigma %.4f\n", name, answered_ / trials_,
                sum_ / answered_, sigma_ / answered_);
    EXPECT_GT(answered_, 0.99 * trials_) << name;
    EXPECT_GT(sum_ / answered_, 0.9) << name;
    EXPECT_LT(sum_ / answered_, 1.2) << name;
  }

 private:
  double trials_ = 0, answered_ = 0, sum_ = 0, sigma_ = 0;
};

TEST(FocalLengthTest, CovarianceOfDirectionsIsHonest) {
  Random random(4);
  Nees right, oblique, three;
  for (int i = 0; i < NumScenes(2000); ++i) {
    const FocalScene scene(&random, 30.0, 60.0);
    const auto x = scene.NoisyPencil(Vector3d::UnitX(), kSigma, &random);
    const auto y = scene.NoisyPencil(Vector3d::UnitY(), kSigma, &random);
    const auto z = scene.NoisyPencil(Vector3d::UnitZ(), kSigma, &random);
    const Vector3d direction = scene.rotation.transpose() * Vector3d::UnitZ();
    std::array<FocalSolution, 2> two;
    // The two axes that are farthest from parallel to the image.
    Eigen::Index flat;
    direction.cwiseAbs().minCoeff(&flat);
    const std::array<VanishingPointFit, 3> all = {x, y, z};
    const auto& a = all[static_cast<std::size_t>((flat + 1) % 3)];
    const auto& b = all[static_cast<std::size_t>((flat + 2) % 3)];
    right.Add(FocalFromVanishingPoints(a, b, 0.5 * kPi, 0.0, &two), two.data(), scene.focal);
    FocalSolution one;
    three.Add(FocalFromThreeVanishingPoints(all, 0.0, &one), &one, scene.focal);
    // An angle that is itself uncertain, between the plane's normal and a direction 50 degrees off.
    const double angle = 50.0 * kDegree, angle_sigma = 0.002;
    const Vector3d across = Vector3d::UnitZ().cross(direction).normalized();
    const double true_angle = angle + angle_sigma * random.Normal();
    const Vector3d off = std::cos(true_angle) * Vector3d::UnitZ() +
                         std::sin(true_angle) * across.cross(Vector3d::UnitZ());
    const auto c = scene.NoisyPencil(off, kSigma, &random);
    oblique.Add(FocalFromVanishingPoints(z, c, angle, angle_sigma, &two), two.data(), scene.focal);
  }
  right.Expect("two orthogonal");
  oblique.Expect("two at an uncertain angle");
  three.Expect("three orthogonal");
}

TEST(FocalLengthTest, CovarianceOfCirclesIsHonest) {
  Random random(5);
  Nees center, concentric, nested, beside, pencil, equal, lattice;
  for (int i = 0; i < NumScenes(1000); ++i) {
    const FocalScene scene(&random, 30.0, 60.0);
    const ConicFit circle = scene.NoisyConic(0.0, 0.5, 2.0, kSigma, &random);
    const ConicFit inner = scene.NoisyConic(0.0, 0.5, 1.2, kSigma, &random);
    const ConicFit off = scene.NoisyConic(0.5, 0.8, 1.0, kSigma, &random);
    const ConicFit a = scene.NoisyConic(2.5, 0.0, 1.5, kSigma, &random);
    const ConicFit b = scene.NoisyConic(-1.5, 2.0, 1.5, kSigma, &random);
    const ConicFit c = scene.NoisyConic(-1.5, -2.0, 1.5, kSigma, &random);
    const auto v = scene.NoisyPencil(Vector3d::UnitX(), kSigma, &random);
    const auto w = scene.NoisyPencil(Vector3d::UnitY(), kSigma, &random);
    const CalibratedPoint o = FocalScene::Noisy(scene.Point(0.0, 0.5), kSigma, &random);
    Matrix3d o_covariance = Matrix3d::Zero();
    o_covariance(0, 0) = o_covariance(1, 1) = std::pow(kSigma / kGuess, 2);
    FocalSolution one;
    std::array<FocalSolution, 2> two;
    std::array<FocalSolution, 4> four;
    center.Add(FocalFromCircleAndCenter(circle, o.Homogeneous(), o_covariance, &one), &one,
               scene.focal);
    concentric.Add(FocalFromConcentricCircles(circle, inner, &one), &one, scene.focal);
    nested.Add(FocalFromCoplanarCircles(circle, off, &two), two.data(), scene.focal);
    beside.Add(FocalFromCoplanarCircles(a, b, &two), two.data(), scene.focal);
    PlaneEvidence evidence;
    evidence.circles = {&circle};
    evidence.pencils = {&v};
    pencil.Add(FocalFromPlane(evidence, kMinFocal, kMaxFocal, &four), four.data(), scene.focal);
    evidence.circles = {&a, &b, &c};
    evidence.pencils.clear();
    evidence.radii = {1.0, 1.0, 1.0};
    equal.Add(FocalFromPlane(evidence, kMinFocal, kMaxFocal, &four), four.data(), scene.focal);
    evidence.pencils = {&v, &w};
    evidence.orthogonal_pencils = true;
    lattice.Add(FocalFromPlane(evidence, kMinFocal, kMaxFocal, &four), four.data(), scene.focal);
  }
  center.Expect("circle and centre");
  concentric.Expect("concentric circles");
  nested.Expect("nested circles");
  beside.Expect("circles side by side");
  pencil.Expect("circle and pencil");
  equal.Expect("three circles of one size");
  lattice.Expect("three of a lattice");
}

// What moves in the image when the principal point does.
ConicFit Moved(ConicFit fit, const Vector2d& by) {
  Matrix3d T = Matrix3d::Identity();
  T.topRightCorner<2, 1>() = by;
  fit.conic = TransformConic(fit.conic, T);
  fit.conic /= fit.conic.norm();
  return fit;
}
VanishingPointFit Moved(VanishingPointFit fit, const Vector2d& by) {
  fit.direction.head<2>() -= fit.direction.z() * by;
  return fit;
}

TEST(FocalLengthTest, DerivativesByThePrincipalPointAreThoseOfMovedInputs) {
  Random random(6);
  const double step = 1e-6;
  for (int i = 0; i < Trials(100); ++i) {
    const FocalScene scene(&random, 30.0, 60.0);
    const ConicFit a = scene.Conic(1.5, 0.0, 1.0), b = scene.Conic(-1.5, 1.0, 1.0);
    const auto v = ExactDirection(scene.Direction(Vector3d(0.6, 0.8, 0.0)));
    const auto w = ExactDirection(scene.Direction(Vector3d(-0.8, 0.6, 0.0)));
    const auto z = ExactDirection(scene.Direction(Vector3d::UnitZ()));
    // Log focal lengths nearest to the truth with the principal point at p, and what is stated.
    const auto solve = [&](const Vector2d& p, std::vector<FocalSolution>* found) {
      const ConicFit ma = Moved(a, p), mb = Moved(b, p);
      const auto mv = Moved(v, p), mw = Moved(w, p), mz = Moved(z, p);
      std::array<FocalSolution, 4> s;
      std::array<FocalSolution, 2> two;
      PlaneEvidence evidence{{&ma, &mb}, {1.0, 1.0}, {&mv, &mw}, true, 1e-3, 1e-3};
      const auto keep = [&](int count, const FocalSolution* all) {
        ASSERT_GT(count, 0);
        found->push_back(*std::min_element(all, all + count, [&](const auto& c, const auto& d) {
          return std::abs(c.focal - scene.focal) < std::abs(d.focal - scene.focal);
        }));
      };
      keep(FocalFromPlane(evidence, kMinFocal, kMaxFocal, &s), s.data());
      keep(FocalFromCoplanarCircles(ma, mb, &two), two.data());
      keep(FocalFromThreeVanishingPoints({mv, mw, mz}, 0.0, &s[0]), s.data());
    };
    std::vector<FocalSolution> here;
    solve(Vector2d::Zero(), &here);
    for (int k = 0; k < 2; ++k) {
      std::vector<FocalSolution> plus, minus;
      solve(step * Vector2d::Unit(k), &plus);
      solve(-step * Vector2d::Unit(k), &minus);
      for (std::size_t form = 0; form < here.size(); ++form) {
        const double difference = std::log(plus[form].focal / minus[form].focal) / (2.0 * step);
        EXPECT_NEAR(here[form].per_principal_point[k], difference,
                    1e-4 * (1.0 + std::abs(difference)))
            << form;
      }
    }
  }
}

}  // namespace
}  // namespace circline
