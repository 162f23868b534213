#include "circline/estimators/conic.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <limits>

#include "circline/estimators/basics.h"
#include "circline/estimators/geometric_residuals.h"
#include "circline/estimators/random.h"

namespace circline {
namespace {

TEST(ConicTest, EllipseRoundTrip) {
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    Ellipse in;
    in.center = {random.Uniform(-2.0, 2.0), random.Uniform(-2.0, 2.0)};
    in.a = random.Uniform(0.1, 2.0);
    in.b = in.a * random.Uniform(0.05, 0.95);
    in.angle = random.Uniform(-1.57, 1.57);
    Ellipse out;
    // Any scale and sign describe the same conic.
    ASSERT_TRUE(ConicToEllipse(-3.7 * EllipseToConic(in), &out));
    EXPECT_LT((out.center - in.center).norm(), 1e-9);
    EXPECT_NEAR(out.a, in.a, 1e-9);
    EXPECT_NEAR(out.b, in.b, 1e-9);
    EXPECT_LT(std::abs(std::remainder(out.angle - in.angle, kPi)), 1e-9);
    const Eigen::Vector2d p = EllipsePoint(in, random.Uniform(0.0, 6.28));
    const Eigen::Vector3d x(p.x(), p.y(), 1.0);
    EXPECT_NEAR(x.dot(EllipseToConic(in) * x), 0.0, 1e-12);
  }
}

TEST(ConicTest, OnlyEllipsesNormalize) {
  const auto rejects = [](double a, double b, double c) {
    Eigen::Matrix3d out;
    return !NormalizeEllipse(Eigen::Vector3d(a, b, c).asDiagonal(), &out);
  };
  EXPECT_FALSE(rejects(1.0, 2.0, -1.0));
  EXPECT_FALSE(rejects(-1.0, -2.0, 1.0));
  EXPECT_TRUE(rejects(1.0, 2.0, 1.0));    // Imaginary.
  EXPECT_TRUE(rejects(1.0, -2.0, -1.0));  // Hyperbola.
  EXPECT_TRUE(rejects(1.0, 0.0, -1.0));   // Two lines.
  EXPECT_TRUE(rejects(1.0, 2.0, 0.0));    // A point.
  EXPECT_TRUE(rejects(0.0, 0.0, 0.0));
  EXPECT_TRUE(rejects(std::numeric_limits<double>::quiet_NaN(), 1.0, -1.0));
  EXPECT_TRUE(rejects(std::numeric_limits<double>::infinity(), 1.0, -1.0));
}

TEST(ConicTest, VectorKeepsTheNorm) {
  Eigen::Matrix3d C;
  C << 1, 2, 3, 2, -4, 5, 3, 5, 6;
  EXPECT_NEAR(ConicToVector(C).norm(), C.norm(), 1e-14);
  EXPECT_LT((VectorToConic(ConicToVector(C)) - C).norm(), 1e-14);
}

TEST(ConicTest, DistanceIsInPixelsOfThePhoto) {
  // A circle of 100 px radius seen with focal length 500: a point 3 px outside is 3 px away, up to
  // the second order 3^2 / (2 x 100).
  Ellipse circle;
  circle.a = circle.b = 100.0 / 500.0;
  CalibratedPoint p;
  p.x = {103.0 / 500.0, 0.0};
  p.x_from_pixel = {1.0 / 500.0, 0.0, 0.0, 1.0 / 500.0};
  EXPECT_NEAR(ConicDistancePx(p, EllipseToConic(circle)), 3.0, 0.05);
  p.x.x() = 97.0 / 500.0;
  EXPECT_NEAR(ConicDistancePx(p, EllipseToConic(circle)), -3.0, 0.05);
  p.x.setZero();
  EXPECT_TRUE(std::isinf(ConicDistancePx(p, EllipseToConic(circle))));
}

TEST(GeometricResidualsTest, JacobiansMatchDifferences) {
  Random random(4);
  for (int i = 0; i < 100; ++i) {
    CalibratedPoint p;
    p.x = {random.Uniform(-0.5, 0.5), random.Uniform(-0.5, 0.5)};
    for (double& v : p.x_from_pixel) v = 2e-3 * random.Normal();
    Vector6d conic, jacobian, unused;
    Eigen::Vector3d line, line_jacobian, line_unused;
    for (int k = 0; k < 6; ++k) conic[k] = random.Normal();
    for (int k = 0; k < 3; ++k) line[k] = random.Normal();
    ConicDistance(p, VectorToConic(conic), &jacobian);
    LineDistance(p, line, &line_jacobian);
    constexpr double kStep = 1e-6;
    for (int k = 0; k < 6; ++k) {
      const Vector6d step = kStep * Vector6d::Unit(k);
      const double numeric = (ConicDistance(p, VectorToConic(conic + step), &unused) -
                              ConicDistance(p, VectorToConic(conic - step), &unused)) /
                             (2.0 * kStep);
      EXPECT_NEAR(jacobian[k], numeric, 1e-5 * (1.0 + jacobian.norm()));
    }
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d step = kStep * Eigen::Vector3d::Unit(k);
      const double numeric = (LineDistance(p, line + step, &line_unused) -
                              LineDistance(p, line - step, &line_unused)) /
                             (2.0 * kStep);
      EXPECT_NEAR(line_jacobian[k], numeric, 1e-5 * (1.0 + line_jacobian.norm()));
    }
  }
}

}  // namespace
}  // namespace circline
