// Exact where nothing is noisy, and what is refused.
#include "circline/estimators/focal_length.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/circle_focal.h"
#include "circline/estimators/plane_focal.h"
#include "circline/estimators/random.h"
#include "tests/estimators/focal_scene.h"
#include "tests/trials.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// Of noise-free scenes: the error of the best solution, relative.
class Errors {
 public:
  void Add(int count, const FocalSolution* solutions, double truth) {
    double best = 1.0;
    for (int i = 0; i < count; ++i) {
      best = std::min(best, std::abs(solutions[i].focal / truth - 1.0));
    }
    solutions_ += count;
    errors_.push_back(best);
  }
  double Quantile(double q) {
    std::sort(errors_.begin(), errors_.end());
    return errors_[static_cast<std::size_t>(q * static_cast<double>(errors_.size() - 1))];
  }
  void Expect(const char* name, double found = 0.999) {
    std::printf("%-28s solutions %.2f median %.1e  99 %% %.1e 99.9 %% %.1e\n", name,
                static_cast<double>(solutions_) / static_cast<double>(errors_.size()),
                Quantile(0.5), Quantile(0.99), Quantile(0.999));
    EXPECT_LE(Quantile(0.5), 1e-10) << name;
    EXPECT_LE(Quantile(found), 1e-6) << name;
  }

 private:
  std::vector<double> errors_;
  long solutions_ = 0;
};

TEST(FocalLengthTest, VanishingPointsAreExact) {
  Random random(1);
  Errors right, oblique, three;
  for (int i = 0; i < NumScenes(10000); ++i) {
    const FocalScene scene(&random);
    const auto x = ExactDirection(scene.Direction(Vector3d::UnitX()));
    const auto y = ExactDirection(scene.Direction(Vector3d::UnitY()));
    const auto z = ExactDirection(scene.Direction(Vector3d::UnitZ()));
    std::array<FocalSolution, 2> two;
    FocalSolution one;
    right.Add(FocalFromVanishingPoints(x, y, 0.5 * kPi, 0.0, &two), two.data(), scene.focal);
    const double angle = random.Uniform(20.0, 85.0) * kDegree;
    const Vector3d d(std::cos(angle), std::sin(angle), 0.0);
    oblique.Add(FocalFromVanishingPoints(x, ExactDirection(-scene.Direction(d)), angle, 0.0, &two),
                two.data(), scene.focal);
    three.Add(FocalFromThreeVanishingPoints({x, y, z}, 0.0, &one), &one, scene.focal);
  }
  right.Expect("two orthogonal");
  oblique.Expect("two at another angle");
  three.Expect("three orthogonal");
}

TEST(FocalLengthTest, CirclesAreExact) {
  Random random(2);
  Errors center, concentric, beside, nested;
  for (int i = 0; i < NumScenes(10000); ++i) {
    const FocalScene scene(&random);
    const double x = random.Uniform(-2.0, 2.0), y = random.Uniform(-2.0, 2.0);
    const ConicFit circle = scene.Conic(x, y, 1.5), inner = scene.Conic(x, y, 0.9);
    const ConicFit off = scene.Conic(x + 0.4, y - 0.2, 0.8), other = scene.Conic(x + 3.0, y, 1.1);
    FocalSolution one;
    std::array<FocalSolution, 2> two;
    center.Add(FocalFromCircleAndCenter(circle, scene.Point(x, y), Matrix3d::Zero(), &one), &one,
               scene.focal);
    concentric.Add(FocalFromConcentricCircles(circle, inner, &one), &one, scene.focal);
    nested.Add(FocalFromCoplanarCircles(circle, off, &two), two.data(), scene.focal);
    beside.Add(FocalFromCoplanarCircles(circle, other, &two), two.data(), scene.focal);
  }
  center.Expect("circle and centre");
  concentric.Expect("concentric circles");
  nested.Expect("nested circles");
  beside.Expect("circles side by side");
}

TEST(FocalLengthTest, PlanesAreExact) {
  Random random(3);
  Errors pencil, equal, known, lattice;
  for (int i = 0; i < NumScenes(1000); ++i) {
    const FocalScene scene(&random);
    const ConicFit a = scene.Conic(-1.5, 0.3, 1.0), b = scene.Conic(1.7, -0.5, 1.0);
    const ConicFit c = scene.Conic(0.2, 2.0, 1.0);
    const double angle = random.Uniform(-kPi, kPi);
    const auto v = ExactDirection(scene.Direction(Vector3d(std::cos(angle), std::sin(angle), 0.0)));
    const auto w =
        ExactDirection(scene.Direction(Vector3d(-std::sin(angle), std::cos(angle), 0.0)));
    std::array<FocalSolution, 4> four;
    PlaneEvidence evidence;
    evidence.circles = {&a};
    evidence.pencils = {&v};
    pencil.Add(FocalFromPlane(evidence, kMinFocal, kMaxFocal, &four), four.data(), scene.focal);
    evidence.circles = {&a, &b};
    evidence.pencils.clear();
    evidence.radii = {1.0, 1.0};
    equal.Add(FocalFromPlane(evidence, kMinFocal, kMaxFocal, &four), four.data(), scene.focal);
    const ConicFit small = scene.Conic(1.7, -0.5, 0.7);
    evidence.circles = {&a, &small};
    evidence.radii = {3.0, 2.1};
    known.Add(FocalFromPlane(evidence, kMinFocal, kMaxFocal, &four), four.data(), scene.focal);
    evidence.circles = {&a, &b, &c};
    evidence.radii = {1.0, 1.0, 1.0};
    evidence.pencils = {&v, &w};
    evidence.orthogonal_pencils = true;
    lattice.Add(FocalFromPlane(evidence, kMinFocal, kMaxFocal, &four), four.data(), scene.focal);
  }
  pencil.Expect("circle and pencil");
  equal.Expect("two circles of one size");
  known.Expect("two of known radii");
  lattice.Expect("three of a lattice");
}
TEST(FocalLengthTest, RefusesInWords) {
  const auto expect = [](FocalRefusal why, FocalRefusal expected) {
    EXPECT_EQ(why, expected) << FocalRefusalSentence(why);
    EXPECT_GT(std::string(FocalRefusalSentence(why)).size(), 10U);
  };
  Random random(7);
  FocalScene tilted(&random, 40.0, 40.0);
  FocalScene frontal(&random, 0.0, 0.0);
  FocalRefusal why = FocalRefusal::kNone;
  FocalSolution one;
  std::array<FocalSolution, 2> two;
  std::array<FocalSolution, 4> four;
  // Directions.
  const auto x = ExactDirection(tilted.Direction(Vector3d::UnitX()));
  const auto flat = ExactDirection({0.6, 0.8, 0.0});
  EXPECT_EQ(FocalFromVanishingPoints(x, flat, 1.0, 0.0, &two, &why), 0);
  expect(why, FocalRefusal::kAtInfinity);
  auto blurred = x;
  blurred.covariance(2, 2) = 1.0;
  EXPECT_EQ(FocalFromVanishingPoints(x, blurred, 1.0, 0.0, &two, &why), 0);
  expect(why, FocalRefusal::kAtInfinity);
  EXPECT_EQ(FocalFromVanishingPoints(x, x, 0.0, 0.0, &two, &why), 0);
  expect(why, FocalRefusal::kParallel);
  const auto left = ExactDirection({-1.0, 0.0, 1.0}), right = ExactDirection({1.0, 0.0, 1.0});
  EXPECT_EQ(FocalFromVanishingPoints(right, ExactDirection({2.0, 0.0, 1.0}), 1.5, 0.0, &two, &why),
            0);
  expect(why, FocalRefusal::kNoAngle);
  EXPECT_EQ(
      FocalFromVanishingPoints(right, ExactDirection({2.0, 0.0, 1.0}), 0.5 * kPi, 0.0, &two, &why),
      0);
  expect(why, FocalRefusal::kNotPositive);
  EXPECT_EQ(FocalFromVanishingPoints(left, right, 0.5 * kPi, 3.0, &two, &why), 0);
  expect(why, FocalRefusal::kUndetermined);
  EXPECT_EQ(
      FocalFromThreeVanishingPoints({x, flat, ExactDirection(Vector3d::UnitX())}, 0.0, &one, &why),
      0);
  expect(why, FocalRefusal::kAtInfinity);
  // A frontal plane.
  const ConicFit a = frontal.Conic(1.5, 0.3, 1.0), b = frontal.Conic(-1.5, 0.2, 1.0);
  const ConicFit in_a = frontal.Conic(1.5, 0.3, 0.6);
  const Matrix3d none = Matrix3d::Zero();
  EXPECT_EQ(FocalFromCircleAndCenter(a, frontal.Point(1.5, 0.3), none, &one, &why), 0);
  expect(why, FocalRefusal::kFrontal);
  EXPECT_EQ(FocalFromConcentricCircles(a, in_a, &one, &why), 0);
  expect(why, FocalRefusal::kFrontal);
  EXPECT_EQ(FocalFromCoplanarCircles(a, b, &two, &why), 0);
  expect(why, FocalRefusal::kFrontal);
  PlaneEvidence evidence;
  evidence.radii = {1.0, 1.0};
  for (int i = 0; i < 20; ++i) {
    const ConicFit na = frontal.NoisyConic(1.5, 0.3, 1.0, kSigma, &random);
    const ConicFit nb = frontal.NoisyConic(-1.5, 0.2, 1.0, kSigma, &random);
    evidence.circles = {&na, &nb};
    EXPECT_EQ(FocalFromPlane(evidence, kMinFocal, kMaxFocal, &four, &why), 0);
    EXPECT_TRUE(why == FocalRefusal::kUndetermined || why == FocalRefusal::kOutOfRange);
  }
  // Circles.
  const ConicFit c = tilted.Conic(0.0, 0.3, 1.0), in_c = tilted.Conic(0.0, 0.3, 0.6);
  EXPECT_EQ(FocalFromCoplanarCircles(c, c, &two, &why), 0);
  expect(why, FocalRefusal::kSameCircle);
  EXPECT_EQ(FocalFromConcentricCircles(c, c, &one, &why), 0);
  expect(why, FocalRefusal::kSameCircle);
  EXPECT_EQ(FocalFromCoplanarCircles(c, in_c, &two, &why), 0);
  expect(why, FocalRefusal::kSameCircle);
  EXPECT_EQ(FocalFromCircleAndCenter(c, tilted.Point(1.5, 0.3), none, &one, &why), 0);
  expect(why, FocalRefusal::kLineMeetsCircle);
  ConicFit hyperbola = c;
  hyperbola.conic = Vector3d(1.0, -1.0, -1.0).asDiagonal();
  EXPECT_EQ(FocalFromCoplanarCircles(c, hyperbola, &two, &why), 0);
  expect(why, FocalRefusal::kNoEllipse);
  EXPECT_EQ(FocalFromCircleAndCenter(hyperbola, tilted.Point(0, 0), none, &one, &why), 0);
  expect(why, FocalRefusal::kNoEllipse);
  // A plane.
  evidence.circles = {&c};
  evidence.radii.clear();
  EXPECT_EQ(FocalFromPlane(evidence, kMinFocal, kMaxFocal, &four, &why), 0);
  expect(why, FocalRefusal::kTooLittle);
  evidence.pencils = {&x};
  EXPECT_EQ(FocalFromPlane(evidence, 50.0, 60.0, &four, &why), 0);
  expect(why, FocalRefusal::kOutOfRange);
  evidence.circles = {&c, &hyperbola};
  EXPECT_EQ(FocalFromPlane(evidence, kMinFocal, kMaxFocal, &four, &why), 0);
  expect(why, FocalRefusal::kNoEllipse);
}

TEST(FocalLengthTest, RefusesWhatIsNotFinite) {
  Random random(8);
  const FocalScene scene(&random, 40.0, 40.0);
  const ConicFit a = scene.Conic(1.5, 0.3, 1.0), b = scene.Conic(-1.5, 0.2, 1.0);
  const auto v = ExactDirection(scene.Direction(Vector3d::UnitX()));
  const auto w = ExactDirection(scene.Direction(Vector3d::UnitY()));
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (const bool in_covariance : {false, true}) {
      ConicFit conic = a;
      VanishingPointFit point = v;
      (in_covariance ? conic.covariance[7] : conic.conic(0, 1)) = bad;
      (in_covariance ? point.covariance(0, 0) : point.direction.x()) = bad;
      FocalSolution one;
      std::array<FocalSolution, 2> two;
      std::array<FocalSolution, 4> four;
      PlaneEvidence evidence{{&a, &conic}, {1.0, 1.0}, {&w}, false, 0.0, 0.0};
      PlaneEvidence with_point{{&a, &b}, {1.0, 1.0}, {&point}, false, 0.0, 0.0};
      std::vector<FocalRefusal> whys(7);
      EXPECT_EQ(FocalFromVanishingPoints(point, w, 1.0, 0.0, &two, &whys[0]), 0);
      EXPECT_EQ(FocalFromThreeVanishingPoints({point, v, w}, 0.0, &one, &whys[1]), 0);
      EXPECT_EQ(FocalFromCircleAndCenter(conic, scene.origin, Matrix3d::Zero(), &one, &whys[2]), 0);
      EXPECT_EQ(FocalFromConcentricCircles(a, conic, &one, &whys[3]), 0);
      EXPECT_EQ(FocalFromCoplanarCircles(conic, a, &two, &whys[4]), 0);
      EXPECT_EQ(FocalFromPlane(evidence, kMinFocal, kMaxFocal, &four, &whys[5]), 0);
      EXPECT_EQ(FocalFromPlane(with_point, kMinFocal, kMaxFocal, &four, &whys[6]), 0);
      for (const FocalRefusal why : whys) EXPECT_EQ(why, FocalRefusal::kNotFinite);
    }
  }
}

}  // namespace
}  // namespace circline
