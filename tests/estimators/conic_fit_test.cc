#include "circline/estimators/conic_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <vector>

#include "circline/estimators/random.h"

namespace circline {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kFocal = 800.0;

// Noisy points on an arc of an ellipse of 100 x 60 px, somewhere off the axis.
struct Arc {
  Ellipse ellipse;
  std::vector<CalibratedPoint> truth, noisy;

  Arc(double degrees, double sigma_px, Random* random) {
    ellipse.center = {120.0 / kFocal, -70.0 / kFocal};
    ellipse.a = 100.0 / kFocal;
    ellipse.b = 60.0 / kFocal;
    ellipse.angle = 0.4;
    const double start = random->Uniform(0.0, 2.0 * kPi);
    constexpr int kPoints = 100;
    for (int i = 0; i < kPoints; ++i) {
      CalibratedPoint p;
      p.x_from_pixel = {1.0 / kFocal, 0.0, 0.0, 1.0 / kFocal};
      p.x = EllipsePoint(ellipse, start + degrees / 180.0 * kPi * i / kPoints);
      truth.push_back(p);
      const double dx = random->Normal(), dy = random->Normal();
      p.x += sigma_px / kFocal * Eigen::Vector2d(dx, dy);
      noisy.push_back(p);
    }
  }
};

// C of a fit: squared curve error at the true points over its bound 5 sigma^2.
double SquaredCurveError(const Arc& arc, const Eigen::Matrix3d& conic, double sigma_px) {
  double sum = 0.0;
  for (const CalibratedPoint& p : arc.truth) {
    const double d = ConicDistancePx(p, conic);
    sum += d * d;
  }
  return sum / (5.0 * sigma_px * sigma_px);
}

class ConicFitTest : public ::testing::TestWithParam<std::array<double, 3>> {
};  // Arc, sigma, bar for C.

TEST_P(ConicFitTest, SitsOnTheBoundAndKnowsItsCovariance) {
  const auto [degrees, sigma_px, bar] = GetParam();
  Random random(5);
  constexpr int kTrials = 1000;
  double sum = 0.0, nees = 0.0;
  for (int i = 0; i < kTrials; ++i) {
    const Arc arc(degrees, sigma_px, &random);
    ConicFit fit;
    ASSERT_TRUE(FitConic(arc.noisy, sigma_px, &fit).ok());
    sum += SquaredCurveError(arc, fit.conic, sigma_px);
    const Vector6d truth = ConicToVector(EllipseToConic(arc.ellipse));
    const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(fit.Covariance());
    const Vector6d z = eigen.eigenvectors().transpose() * (ConicToVector(fit.conic) - truth);
    nees += (z.tail<5>().array().square() / eigen.eigenvalues().tail<5>().array()).sum();
    EXPECT_LT(std::abs(eigen.eigenvalues()[0]), 1e-9 * eigen.eigenvalues()[5]);
  }
  EXPECT_LT(std::sqrt(sum / kTrials), bar);
  EXPECT_NEAR(nees / kTrials, 5.0, 0.5);
}

// Arcs on which the linearised covariance holds; 1000 trials scatter C by 1.4 % and the NEES by
// 0.1.
INSTANTIATE_TEST_SUITE_P(Arcs, ConicFitTest,
                         ::testing::Values(std::array<double, 3>{360.0, 1.0, 1.03},
                                           std::array<double, 3>{360.0, 3.0, 1.05},
                                           std::array<double, 3>{180.0, 1.0, 1.04},
                                           std::array<double, 3>{120.0, 1.0, 1.04},
                                           std::array<double, 3>{90.0, 0.2, 1.04}));

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
