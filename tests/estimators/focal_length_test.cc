#include "circline/estimators/focal_length.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <string>
#include <vector>

#include "circline/estimators/circle_focal.h"
#include "circline/estimators/circle_pose.h"
#include "circline/estimators/plane_focal.h"
#include "circline/estimators/random.h"
#include "tests/trials.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;
constexpr double kDegree = kPi / 180.0;
constexpr double kGuess = 800.0;  // Pixels: the length that the coordinates are in units of.
constexpr double kMinFocal = 0.35, kMaxFocal = 7.0;

int NumScenes(int number) {
  const char* text = std::getenv("CIRCLINE_FOCAL_SCENES");
  return text != nullptr && std::atoi(text) > 0 ? std::atoi(text) : Trials(number);
}

// A plane seen by a camera whose focal length is half to twice the guess.
struct Scene {
  double focal;
  Matrix3d rotation;  // cam_from_world of the plane Z = 0 at distance 10 along the optical axis.
  Vector3d origin{0.0, 0.0, 10.0};

  Scene(Random* random, double min_tilt_deg = 10.0, double max_tilt_deg = 70.0)
      : focal(std::exp2(random->Uniform(-1.0, 1.0))) {
    const double tilt = random->Uniform(min_tilt_deg, max_tilt_deg) * kDegree;
    const double about = random->Uniform(-kPi, kPi), spin = random->Uniform(-kPi, kPi);
    const Eigen::AngleAxisd tilted(tilt, Vector3d(std::cos(about), std::sin(about), 0.0));
    rotation =
        tilted.toRotationMatrix() * Eigen::AngleAxisd(spin, Vector3d::UnitZ()).toRotationMatrix();
  }

  Vector3d K() const { return {focal, focal, 1.0}; }
  Vector3d At(double x, double y) const {
    return origin + x * rotation.col(0) + y * rotation.col(1);
  }
  Vector3d Point(double x, double y) const { return K().cwiseProduct(At(x, y)); }
  Vector3d Direction(const Vector3d& world) const {
    return K().cwiseProduct(rotation * world).normalized();
  }
  ConicFit Conic(double x, double y, double radius) const {
    CirclePose pose;
    pose.center = At(x, y) / radius;
    pose.normal = rotation.col(2);
    const Vector3d inverse = K().cwiseInverse();
    ConicFit fit;
    NormalizeEllipse(inverse.asDiagonal() * ProjectCircle(pose) * inverse.asDiagonal(), &fit.conic);
    return fit;
  }
  // The same from 100 contour points with noise.
  ConicFit NoisyConic(double x, double y, double radius, double sigma_px, Random* random) const {
    std::vector<CalibratedPoint> points;
    for (int i = 0; i < 100; ++i) {
      const double a = 2.0 * kPi * i / 100.0;
      points.push_back(
          Noisy(Point(x + radius * std::cos(a), y + radius * std::sin(a)), sigma_px, random));
    }
    ConicFit fit;
    EXPECT_TRUE(FitConic(points, sigma_px, &fit).ok());
    return fit;
  }
  static CalibratedPoint Noisy(const Vector3d& point, double sigma_px, Random* random) {
    CalibratedPoint p;
    const double dx = random->Normal(), dy = random->Normal();
    p.x = point.hnormalized() + sigma_px / kGuess * Vector2d(dx, dy);
    p.x_from_pixel = {1.0 / kGuess, 0.0, 0.0, 1.0 / kGuess};
    return p;
  }
  VanishingPointFit NoisyPencil(const Vector3d& world, double sigma_px, Random* random) const {
    std::vector<LineFit> lines;
    const Vector3d across = world.unitOrthogonal(), other = world.cross(across);
    for (const auto& [u, v] : {std::pair(-2.0, 1.0), {2.0, 1.0}, {-2.0, -1.0}, {2.0, -1.0}}) {
      std::vector<CalibratedPoint> points;
      for (int i = -5; i <= 5; ++i) {
        const Vector3d X = origin + rotation * (0.4 * i * world + u * across + v * other);
        points.push_back(Noisy(K().cwiseProduct(X), sigma_px, random));
      }
      LineFit line;
      EXPECT_TRUE(FitLine(points, sigma_px, &line).ok());
      lines.push_back(line);
    }
    VanishingPointFit fit;
    EXPECT_TRUE(FitVanishingPoint(lines, &fit).ok());
    return fit;
  }
};

VanishingPointFit Exact(const Vector3d& direction) {
  VanishingPointFit fit;
  fit.direction = direction;
  return fit;
}

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
    const Scene scene(&random);
    const auto x = Exact(scene.Direction(Vector3d::UnitX()));
    const auto y = Exact(scene.Direction(Vector3d::UnitY()));
    const auto z = Exact(scene.Direction(Vector3d::UnitZ()));
    std::array<FocalSolution, 2> two;
    FocalSolution one;
    right.Add(FocalFromVanishingPoints(x, y, 0.5 * kPi, 0.0, &two), two.data(), scene.focal);
    const double angle = random.Uniform(20.0, 85.0) * kDegree;
    const Vector3d d(std::cos(angle), std::sin(angle), 0.0);
    oblique.Add(FocalFromVanishingPoints(x, Exact(-scene.Direction(d)), angle, 0.0, &two),
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
    const Scene scene(&random);
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
    const Scene scene(&random);
    const ConicFit a = scene.Conic(-1.5, 0.3, 1.0), b = scene.Conic(1.7, -0.5, 1.0);
    const ConicFit c = scene.Conic(0.2, 2.0, 1.0);
    const double angle = random.Uniform(-kPi, kPi);
    const auto v = Exact(scene.Direction(Vector3d(std::cos(angle), std::sin(angle), 0.0)));
    const auto w = Exact(scene.Direction(Vector3d(-std::sin(angle), std::cos(angle), 0.0)));
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

constexpr double kSigma = 0.1;  // Pixels: small, so that first order holds.

TEST(FocalLengthTest, CovarianceOfDirectionsIsHonest) {
  Random random(4);
  Nees right, oblique, three;
  for (int i = 0; i < NumScenes(2000); ++i) {
    const Scene scene(&random, 30.0, 60.0);
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
    const Scene scene(&random, 30.0, 60.0);
    const ConicFit circle = scene.NoisyConic(0.0, 0.5, 2.0, kSigma, &random);
    const ConicFit inner = scene.NoisyConic(0.0, 0.5, 1.2, kSigma, &random);
    const ConicFit off = scene.NoisyConic(0.5, 0.8, 1.0, kSigma, &random);
    const ConicFit a = scene.NoisyConic(2.5, 0.0, 1.5, kSigma, &random);
    const ConicFit b = scene.NoisyConic(-1.5, 2.0, 1.5, kSigma, &random);
    const ConicFit c = scene.NoisyConic(-1.5, -2.0, 1.5, kSigma, &random);
    const auto v = scene.NoisyPencil(Vector3d::UnitX(), kSigma, &random);
    const auto w = scene.NoisyPencil(Vector3d::UnitY(), kSigma, &random);
    const CalibratedPoint o = Scene::Noisy(scene.Point(0.0, 0.5), kSigma, &random);
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
    const Scene scene(&random, 30.0, 60.0);
    const ConicFit a = scene.Conic(1.5, 0.0, 1.0), b = scene.Conic(-1.5, 1.0, 1.0);
    const auto v = Exact(scene.Direction(Vector3d(0.6, 0.8, 0.0)));
    const auto w = Exact(scene.Direction(Vector3d(-0.8, 0.6, 0.0)));
    const auto z = Exact(scene.Direction(Vector3d::UnitZ()));
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

TEST(FocalLengthTest, RefusesInWords) {
  const auto expect = [](FocalRefusal why, FocalRefusal expected) {
    EXPECT_EQ(why, expected) << FocalRefusalSentence(why);
    EXPECT_GT(std::string(FocalRefusalSentence(why)).size(), 10U);
  };
  Random random(7);
  Scene tilted(&random, 40.0, 40.0);
  Scene frontal(&random, 0.0, 0.0);
  FocalRefusal why = FocalRefusal::kNone;
  FocalSolution one;
  std::array<FocalSolution, 2> two;
  std::array<FocalSolution, 4> four;
  // Directions.
  const auto x = Exact(tilted.Direction(Vector3d::UnitX()));
  const auto flat = Exact({0.6, 0.8, 0.0});
  EXPECT_EQ(FocalFromVanishingPoints(x, flat, 1.0, 0.0, &two, &why), 0);
  expect(why, FocalRefusal::kAtInfinity);
  auto blurred = x;
  blurred.covariance(2, 2) = 1.0;
  EXPECT_EQ(FocalFromVanishingPoints(x, blurred, 1.0, 0.0, &two, &why), 0);
  expect(why, FocalRefusal::kAtInfinity);
  EXPECT_EQ(FocalFromVanishingPoints(x, x, 0.0, 0.0, &two, &why), 0);
  expect(why, FocalRefusal::kParallel);
  const auto left = Exact({-1.0, 0.0, 1.0}), right = Exact({1.0, 0.0, 1.0});
  EXPECT_EQ(FocalFromVanishingPoints(right, Exact({2.0, 0.0, 1.0}), 1.5, 0.0, &two, &why), 0);
  expect(why, FocalRefusal::kNoAngle);
  EXPECT_EQ(FocalFromVanishingPoints(right, Exact({2.0, 0.0, 1.0}), 0.5 * kPi, 0.0, &two, &why), 0);
  expect(why, FocalRefusal::kNotPositive);
  EXPECT_EQ(FocalFromVanishingPoints(left, right, 0.5 * kPi, 3.0, &two, &why), 0);
  expect(why, FocalRefusal::kUndetermined);
  EXPECT_EQ(FocalFromThreeVanishingPoints({x, flat, Exact(Vector3d::UnitX())}, 0.0, &one, &why), 0);
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
  const Scene scene(&random, 40.0, 40.0);
  const ConicFit a = scene.Conic(1.5, 0.3, 1.0), b = scene.Conic(-1.5, 0.2, 1.0);
  const auto v = Exact(scene.Direction(Vector3d::UnitX()));
  const auto w = Exact(scene.Direction(Vector3d::UnitY()));
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
