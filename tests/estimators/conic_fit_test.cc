#include "circline/estimators/conic_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/random.h"
#include "tests/basics.h"
#include "tests/trials.h"

namespace circline {
namespace {

constexpr double kFocal = 800.0;

// Noisy points on an arc of an ellipse of 100 x 60 px or so, somewhere off the axis.
struct Arc {
  Ellipse ellipse;
  std::vector<CalibratedPoint> truth, noisy;

  Arc(double degrees, double sigma_px, Random* random, double shorter_px = 60.0) {
    ellipse.center = {120.0 / kFocal, -70.0 / kFocal};
    ellipse.a = 100.0 / kFocal;
    ellipse.b = shorter_px / kFocal;
    ellipse.angle = 0.4;
    const double start = random->Uniform(0.0, 2.0 * kPi);
    constexpr int kPoints = 100;
    for (int i = 0; i < kPoints; ++i) {
      CalibratedPoint p;
      p.x_from_pixel = {1.0 / kFocal, 0.0, 0.0, 1.0 / kFocal};
      p.x = EllipsePoint(ellipse, start + degrees * kDegree * i / kPoints);
      truth.push_back(p);
      p.x += Noise2(sigma_px / kFocal, random);
      noisy.push_back(p);
    }
  }
};

// Orthogonal distance to a conic, signed, pixels, by repeating Sampson's step from the foot point;
// and its derivative by ConicToVector(C).
double CurveDistancePx(const CalibratedPoint& p, const Eigen::Matrix3d& C,
                       Vector6d* derivative = nullptr) {
  Eigen::Vector2d foot = p.x, g;
  for (int i = 0; i < 30; ++i) {
    const Eigen::Vector3d polar = C * foot.homogeneous();
    g = 2.0 * polar.head<2>();
    foot = p.x - g * ((foot.homogeneous().dot(polar) + g.dot(p.x - foot)) / g.squaredNorm());
  }
  if (derivative != nullptr) {
    const Eigen::Vector3d x = foot.homogeneous();
    *derivative = kFocal / g.norm() * ConicToVector(x * x.transpose());
  }
  return kFocal * (p.x - foot).dot(g) / g.norm();
}

// Normalised squared error of the curve: the five independent combinations of its distances from
// the true points that the stated covariance speaks of, in standard deviations.
double CurveNees(const Arc& arc, const ConicFit& fit) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(fit.Covariance());
  const Eigen::Matrix<double, 6, 5> root =
      eigen.eigenvectors().rightCols<5>() * eigen.eigenvalues().tail<5>().cwiseSqrt().asDiagonal();
  const auto n = static_cast<Eigen::Index>(arc.truth.size());
  Eigen::Matrix<double, Eigen::Dynamic, 5> columns(n, 5);
  Eigen::VectorXd distances(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    Vector6d derivative;
    distances[i] = CurveDistancePx(arc.truth[static_cast<std::size_t>(i)], fit.conic, &derivative);
    columns.row(i) = derivative.transpose() * root;
  }
  return columns.colPivHouseholderQr().solve(distances).squaredNorm();
}

// The same of the conic's vector, which bends where the noise is large against the shape.
double VectorNees(const Arc& arc, const ConicFit& fit) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(fit.Covariance());
  const Vector6d truth = ConicToVector(EllipseToConic(arc.ellipse));
  const Vector6d z = eigen.eigenvectors().transpose() * (ConicToVector(fit.conic) - truth);
  EXPECT_LT(std::abs(eigen.eigenvalues()[0]), 1e-9 * eigen.eigenvalues()[5]);
  return (z.tail<5>().array().square() / eigen.eigenvalues().tail<5>().array()).sum();
}

// C of a fit: squared curve error at the true points over its bound 5 sigma^2.
double SquaredCurveError(const Arc& arc, const Eigen::Matrix3d& conic, double sigma_px) {
  double sum = 0.0;
  for (const CalibratedPoint& p : arc.truth) {
    const double d = CurveDistancePx(p, conic);
    sum += d * d;
  }
  return sum / (5.0 * sigma_px * sigma_px);
}

struct ArcCase {
  double degrees, sigma_px, shorter_px;
  double bar;                       // For C over 1000 trials.
  bool curve_is_calibrated = true;  // Its mean NEES over 2000 trials is 5 +- 0.3.
  bool vector_is_calibrated = true;
};

class ConicFitArcTest : public ::testing::TestWithParam<ArcCase> {};

TEST_P(ConicFitArcTest, SitsOnTheBoundAndKnowsItsCovariance) {
  const ArcCase c = GetParam();
  Random random(5);
  constexpr int kTrials = Trials(2000);
  double sum = 0.0, curve_nees = 0.0, vector_nees = 0.0;
  for (int i = 0; i < kTrials; ++i) {
    const Arc arc(c.degrees, c.sigma_px, &random, c.shorter_px);
    ConicFit fit;
    ASSERT_TRUE(FitConic(arc.noisy, c.sigma_px, &fit).ok());
    sum += SquaredCurveError(arc, fit.conic, c.sigma_px);
    curve_nees += CurveNees(arc, fit) / kTrials;
    vector_nees += VectorNees(arc, fit) / kTrials;
  }
  if (kSanitized) return;
  const double curve_error = std::sqrt(sum / kTrials);
  std::printf(
      "%3.0f degrees, 100:%.0f px, sigma %.1f px: C %.3f (bar %.2f), NEES %.2f, of the conic's "
      "vector %.2f\n",
      c.degrees, c.shorter_px, c.sigma_px, curve_error, c.bar, curve_nees, vector_nees);
  EXPECT_LE(curve_error, c.bar);
  if (c.curve_is_calibrated) {
    EXPECT_NEAR(curve_nees, 5.0, 0.3);
  }
  if (c.vector_is_calibrated) {
    EXPECT_NEAR(vector_nees, 5.0, 0.3);
  }
}

// 2000 trials scatter C by 0.7 % and the NEES by 0.07. The whole ellipse of 100:25 px has a radius
// of curvature of 6 px at its ends: noise of 3 px moves it outwards by 0.7 px there, which no
// covariance tells.
INSTANTIATE_TEST_SUITE_P(
    Arcs, ConicFitArcTest,
    ::testing::Values(ArcCase{360.0, 1.0, 60.0, 1.01}, ArcCase{360.0, 3.0, 60.0, 1.03},
                      ArcCase{180.0, 1.0, 60.0, 1.02}, ArcCase{180.0, 3.0, 60.0, 1.03, true, false},
                      ArcCase{120.0, 1.0, 60.0, 1.02}, ArcCase{90.0, 0.2, 60.0, 1.02},
                      ArcCase{90.0, 0.5, 60.0, 1.02}, ArcCase{90.0, 1.0, 60.0, 1.02, true, false},
                      ArcCase{90.0, 2.0, 60.0, 1.03, true, false},
                      ArcCase{360.0, 3.0, 25.0, 1.10, false, false},
                      ArcCase{360.0, 1.0, 25.0, 1.02}));

// The residual is the distance to the nearest point of the ellipse, wherever the point is.
TEST(ConicFitTest, DistancesAreOrthogonal) {
  Random random(9);
  for (int trial = 0; trial < 50; ++trial) {
    Arc arc(360.0, 0.5, &random, trial % 2 == 0 ? 60.0 : 25.0);
    // A stray point of next to no weight: far away, deep inside, or the centre itself.
    CalibratedPoint stray = arc.noisy.front();
    const double reach = 1.5 * arc.ellipse.a;
    stray.x += Eigen::Vector2d{random.Uniform(-reach, reach), random.Uniform(-reach, reach)};
    if (trial < 2) stray.x = arc.ellipse.center;
    constexpr double kWeight = 1e-6;
    std::vector<double> weights(arc.noisy.size(), 1.0);
    arc.noisy.push_back(stray);
    weights.push_back(kWeight);
    ConicFit fit;
    ASSERT_TRUE(FitConic(arc.noisy, 0.5, &fit, &weights).ok());
    Ellipse ellipse;
    ASSERT_TRUE(ConicToEllipse(fit.conic, &ellipse));
    // By sampling, then by thirds about the best sample.
    const auto nearest = [&ellipse](const Eigen::Vector2d& x) {
      const auto square = [&](double t) { return (EllipsePoint(ellipse, t) - x).squaredNorm(); };
      constexpr double kStep = 2.0 * kPi / 500.0;
      double best = 0.0;
      for (double t = 0.0; t < 2.0 * kPi; t += kStep) {
        if (square(t) < square(best)) best = t;
      }
      double low = best - kStep, high = best + kStep;
      for (int i = 0; i < 60; ++i) {
        const double a = (2.0 * low + high) / 3.0, b = (low + 2.0 * high) / 3.0;
        (square(a) < square(b) ? high : low) = square(a) < square(b) ? b : a;
      }
      return kFocal * kFocal * square(low);
    };
    double sum = 0.0, weight = 0.0;
    for (std::size_t i = 0; i < arc.noisy.size(); ++i) {
      sum += weights[i] * nearest(arc.noisy[i].x);
      weight += weights[i];
    }
    EXPECT_NEAR(fit.rms_px, std::sqrt(sum / weight), 1e-6 * fit.rms_px);
  }
}

// Symmetric to the last bit: the point at the centre has no nearest point.
TEST(ConicFitTest, ThePointAtTheCentreIsNoObstacle) {
  std::vector<CalibratedPoint> points(9);
  for (std::size_t i = 0; i < 8; ++i) {
    const double c[] = {1.0, 0.6, 0.0, -0.6, -1.0, -0.6, 0.0, 0.6};
    points[i].x = Eigen::Vector2d(
        c[i], 0.5 * (i % 4 == 0 ? 0.0 : (i % 4 == 2 ? 1.0 : 0.8)) * (i < 4 ? 1.0 : -1.0));
  }
  ConicFit fit;
  ASSERT_TRUE(FitConic(points, 1e-3, &fit).ok());
  EXPECT_TRUE(fit.Covariance().allFinite());
  EXPECT_GT(fit.rms_px, 0.1);
}

TEST(ConicFitTest, DirectFitIsNearTheBound) {
  Random random(6);
  constexpr int kTrials = 300;
  double sum = 0.0;
  for (int i = 0; i < kTrials; ++i) {
    const Arc arc(180.0, 1.0, &random);
    Eigen::Matrix3d conic;
    ASSERT_TRUE(FitConicDirect(arc.noisy, &conic).ok());
    sum += SquaredCurveError(arc, conic, 1.0);
  }
  EXPECT_LT(std::sqrt(sum / kTrials), 1.08);
}

TEST(ConicFitTest, NoiseFreePointsAreFittedExactly) {
  Random random(7);
  const Arc arc(360.0, 0.0, &random);
  ConicFit fit;
  ASSERT_TRUE(FitConic(arc.noisy, 1.0, &fit).ok());
  EXPECT_LT((fit.conic - EllipseToConic(arc.ellipse)).norm(), 1e-11);
  EXPECT_LT(fit.rms_px, 1e-8);
  std::array<Eigen::Vector2d, 5> five;
  for (std::size_t i = 0; i < 5; ++i) five[i] = arc.noisy[20 * i].x;
  Eigen::Matrix3d conic;
  ASSERT_TRUE(ConicFromFivePoints(five, &conic));
  ASSERT_TRUE(NormalizeEllipse(conic, &conic));
  EXPECT_LT((conic - EllipseToConic(arc.ellipse)).norm(), 1e-11);
}

TEST(ConicFitTest, WeightsLeaveOutliersOut) {
  Random random(8);
  Arc arc(360.0, 0.1, &random);
  std::vector<double> weights(arc.noisy.size(), 1.0);
  for (std::size_t i = 0; i < 30; ++i) {
    arc.noisy[i].x += Eigen::Vector2d(0.1, 0.2);
    weights[i] = 0.0;
  }
  ConicFit fit;
  ASSERT_TRUE(FitConic(arc.noisy, 0.1, &fit, &weights).ok());
  EXPECT_LT(std::sqrt(SquaredCurveError(arc, fit.conic, 0.1)), 4.0);
  EXPECT_LT(fit.rms_px, 0.15);
}

TEST(ConicFitTest, RefusesWhatIsNoEllipse) {
  const auto status = [](const std::vector<Eigen::Vector2d>& xs) {
    std::vector<CalibratedPoint> points(xs.size());
    for (std::size_t i = 0; i < xs.size(); ++i) points[i].x = xs[i];
    ConicFit fit;
    return FitConic(points, 1.0, &fit);
  };
  EXPECT_EQ(status({{0, 0}, {1, 0}, {0, 1}, {1, 1}}).code, StatusCode::kRefused);
  std::vector<Eigen::Vector2d> line, repeated(20, Eigen::Vector2d(0.3, 0.4));
  for (int i = 0; i < 20; ++i) line.emplace_back(0.01 * i, 0.02 * i + 0.1);
  EXPECT_EQ(status(line).code, StatusCode::kRefused);
  EXPECT_EQ(status(repeated).code, StatusCode::kRefused);
  EXPECT_FALSE(status(repeated).message.empty());
}

}  // namespace
}  // namespace circline
