#include "circline/estimators/circular_points.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>

#include "circline/estimators/circle_pose.h"
#include "circline/estimators/line_pose.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/random.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Vector3d RandomVector(Random* random) {
  return {random->Uniform(-1.0, 1.0), random->Uniform(-1.0, 1.0), random->Uniform(-1.0, 1.0)};
}

Matrix3d RandomRotation(Random* random) { return ExpRotation(3.0 * RandomVector(random)); }

// m^T C m, complex.
std::complex<double> Value(const Matrix3d& C, const CircularPoints& m) {
  return {m.real.dot(C * m.real) - m.imag.dot(C * m.imag), 2.0 * m.real.dot(C * m.imag)};
}

// The same point multiplied by a complex number.
CircularPoints Multiple(const CircularPoints& m, const std::complex<double>& z) {
  return {z.real() * m.real - z.imag() * m.imag, z.imag() * m.real + z.real() * m.imag};
}

CirclePose RandomCircle(Random* random) {
  for (;;) {
    CirclePose pose;
    pose.center = {random->Uniform(-3.0, 3.0), random->Uniform(-3.0, 3.0),
                   random->Uniform(3.0, 20.0)};
    pose.normal = RandomVector(random).normalized();
    if (pose.normal.dot(pose.center) > 0.0) pose.normal = -pose.normal;
    if (pose.normal.dot(pose.center.normalized()) < -0.1) return pose;
  }
}

TEST(CircularPointsTest, LieOnTheAbsoluteConicAndJoinInTheNormal) {
  Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const Vector3d n = RandomVector(&random).normalized();
    CircularPoints m;
    ASSERT_TRUE(CircularPointsOfPlane(3.0 * n, &m));
    EXPECT_LT(std::abs(Value(Matrix3d::Identity(), m)), 1e-15);
    Vector3d line;
    ASSERT_TRUE(
        VanishingLine(Multiple(m, {random.Normal() * 1e200, random.Normal() * 1e200}), &line));
    EXPECT_LT((line - n).norm(), 1e-14);
  }
}

TEST(CircularPointsTest, AreTheImageOfTheCircularPointsOfTheWorldPlane) {
  Random random(2);
  for (int i = 0; i < 1000; ++i) {
    const Matrix3d R = RandomRotation(&random);
    CircularPoints m;
    ASSERT_TRUE(CircularPointsOfPlane(R.col(2), &m));
    // [r1 r2 t] (1, i, 0) is r1 + i r2: parallel as complex vectors, so all 2x2 minors vanish.
    const Eigen::Vector3cd a = m.real.cast<std::complex<double>>() +
                               std::complex<double>(0.0, 1.0) * m.imag.cast<std::complex<double>>();
    const Eigen::Vector3cd b =
        R.col(0).cast<std::complex<double>>() +
        std::complex<double>(0.0, 1.0) * R.col(1).cast<std::complex<double>>();
    const Eigen::Matrix3cd minors = a * b.transpose() - b * a.transpose();
    EXPECT_LT(minors.norm(), 1e-14);
  }
}

TEST(CircularPointsTest, OfAConicLieOnItAndHoldTheTruth) {
  Random random(3);
  for (int i = 0; i < 1000; ++i) {
    const CirclePose truth = RandomCircle(&random);
    const Matrix3d C = ProjectCircle(truth);
    std::array<CircularPoints, 2> m;
    const int count = CircularPointsOfConic(C, &m);
    if (count == 0) continue;  // It crosses the plane of the camera centre: no ellipse.
    ASSERT_EQ(count, 2);
    double best = 2.0;
    for (const CircularPoints& pair : m) {
      EXPECT_LT(std::abs(Value(C, pair)), 1e-13);
      Vector3d line;
      ASSERT_TRUE(VanishingLine(pair, &line));
      best = std::min(best, line.cross(truth.normal).norm());
    }
    EXPECT_LT(best, 1e-11);
  }
  std::array<CircularPoints, 2> m;
  EXPECT_EQ(CircularPointsOfConic(Matrix3d(Vector3d(1.0, 1.0, -0.1).asDiagonal()), &m), 1);
  EXPECT_EQ(CircularPointsOfConic(Matrix3d::Identity(), &m), 0);
}

TEST(CircularPointsTest, DeviationIsTheCosineOfLaguerresAngle) {
  Random random(4);
  for (int i = 0; i < 1000; ++i) {
    const Matrix3d R = RandomRotation(&random);
    CircularPoints m;
    ASSERT_TRUE(CircularPointsOfPlane(R.col(2), &m));
    m = Multiple(m, {random.Normal(), random.Normal()});
    const double phi = random.Uniform(-3.0, 3.0), angle = random.Uniform(-3.0, 3.0);
    const auto direction = [&R](double a) -> Vector3d {
      return std::cos(a) * R.col(0) + std::sin(a) * R.col(1);
    };
    // Lines with these vanishing points.
    const Vector3d x_line = R.col(2).cross(2.0 * direction(phi)),
                   y_line = R.col(2).cross(-0.1 * direction(phi + angle));
    EXPECT_NEAR(HarmonicDeviation(m, x_line, y_line), -std::cos(angle), 1e-13);
  }
}

// Proposition 2 in both its forms: the harmonic conjugate, and l . v_y = v_x . v_y = 0.
TEST(CircularPointsTest, HarmonicConjugateIsTheOrthogonalDirection) {
  Random random(5);
  for (int i = 0; i < 1000; ++i) {
    const Vector3d n = RandomVector(&random).normalized();
    const Vector3d v = n.cross(RandomVector(&random));
    if (v.norm() < 0.1) continue;
    CircularPoints m;
    ASSERT_TRUE(CircularPointsOfPlane(n, &m));
    m = Multiple(m, {random.Normal(), random.Normal()});
    Vector3d conjugate;
    ASSERT_TRUE(HarmonicConjugate(m, v, &conjugate));
    EXPECT_LT((conjugate - n.cross(v)).norm(), 1e-14);
    EXPECT_NEAR(HarmonicDeviation(m, n.cross(v), n.cross(conjugate)), 0.0, 1e-13);
  }
}

TEST(CircularPointsTest, RotationAgreesWithTheOneFromDirections) {
  Random random(6);
  for (int i = 0; i < 1000; ++i) {
    const Vector3d n = RandomVector(&random).normalized(), x_line = RandomVector(&random);
    if (n.cross(x_line).norm() < 0.1) continue;
    CircularPoints m;
    ASSERT_TRUE(CircularPointsOfPlane(n, &m));
    Matrix3d R, expected;
    ASSERT_TRUE(RotationFromCircularPoints(m, x_line, &R));
    const Vector3d v_x = n.cross(x_line);
    ASSERT_TRUE(RotationFromDirections(v_x, n.cross(v_x), &expected));
    EXPECT_LT((R - expected).norm(), 1e-13);
    EXPECT_NEAR(R.determinant(), 1.0, 1e-14);
  }
}

// Proposition 4: cross ratio and orthogonality say the same of every candidate, and zero of the
// true one.
TEST(CircularPointsTest, HarmonicDeviationIsTheCosineBetweenTheAxes) {
  Random random(7);
  for (int i = 0; i < 1000; ++i) {
    const CirclePose circle = RandomCircle(&random);
    CircularPoints truth;
    ASSERT_TRUE(CircularPointsOfPlane(circle.normal, &truth));
    const Vector3d origin = circle.center + 0.3 * truth.real - 0.5 * truth.imag;
    const Vector3d x_line = origin.cross(truth.real), y_line = origin.cross(truth.imag);
    EXPECT_NEAR(HarmonicDeviation(truth, x_line, y_line), 0.0, 1e-12);
    std::array<CircularPoints, 2> m;
    const int count = CircularPointsOfConic(ProjectCircle(circle), &m);
    for (std::size_t k = 0; k < static_cast<std::size_t>(count); ++k) {
      Vector3d n;
      ASSERT_TRUE(VanishingLine(m[k], &n));
      const double cosine = n.cross(x_line).normalized().dot(n.cross(y_line).normalized());
      EXPECT_NEAR(HarmonicDeviation(m[k], x_line, y_line), cosine, 1e-13);
    }
  }
}

TEST(CircularPointsTest, CircleAndFrameGiveTheRotation) {
  Random random(8);
  for (int i = 0; i < 1000; ++i) {
    const CirclePose circle = RandomCircle(&random);
    CircularPoints truth;
    ASSERT_TRUE(CircularPointsOfPlane(circle.normal, &truth));
    const Vector3d origin = circle.center + 0.3 * truth.real - 0.5 * truth.imag;
    const Vector3d x_line = origin.cross(truth.real), y_line = origin.cross(truth.imag);
    std::array<FrameRotation, 2> found;
    const int count = RotationsFromCircleAndFrame(ProjectCircle(circle), x_line, y_line, &found);
    if (count == 0) continue;  // The image is no ellipse.
    Matrix3d expected;
    ASSERT_TRUE(RotationFromCircularPoints(truth, x_line, &expected));
    double best = 2.0;
    for (const Matrix3d& choice : SignChoices(found[0].rotation)) {
      EXPECT_LT((choice.transpose() * choice - Matrix3d::Identity()).norm(), 1e-14);
      best = std::min(best, (choice - expected).norm());
    }
    EXPECT_LT(best, 1e-10);
    EXPECT_LT(found[0].deviation, 1e-10);
    if (count == 2) {
      EXPECT_GE(found[1].deviation, found[0].deviation);
    }
  }
}

// The axis that is known exactly keeps its direction.
TEST(CircularPointsTest, TheWorseKnownAxisGivesWay) {
  CircularPoints plane;
  ASSERT_TRUE(CircularPointsOfPlane(Vector3d::UnitZ(), &plane));
  // X is drawn along X, Y 0.1 radians off a right angle with it.
  const Vector3d x_line(0.0, 1.0, -0.3), y_line(std::cos(0.1), std::sin(0.1), 0.2);
  const double variances[][2] = {{0.0, 1.0}, {1.0, 0.0}, {1.0, 1.0}, {1.0, 3.0}};
  const double turns[] = {0.0, 0.1, 0.05, 0.025};  // Of X.
  for (int i = 0; i < 4; ++i) {
    FrameRotation frame;
    ASSERT_TRUE(RotationFromFrame(plane, x_line, variances[i][0], y_line, variances[i][1], &frame));
    EXPECT_NEAR(std::asin(std::abs(frame.rotation(1, 0))), turns[i], 1e-14);
    EXPECT_NEAR(frame.deviation, std::sin(0.1), 1e-14);
  }
}

TEST(CircularPointsTest, RefusesWhatIsNoPlane) {
  CircularPoints m;
  Vector3d v;
  Matrix3d R;
  EXPECT_FALSE(CircularPointsOfPlane(Vector3d::Zero(), &m));
  EXPECT_FALSE(CircularPointsOfPlane(Vector3d(1.0, kNaN, 0.0), &m));
  EXPECT_FALSE(VanishingLine({Vector3d::UnitX(), 2.0 * Vector3d::UnitX()}, &v));
  ASSERT_TRUE(CircularPointsOfPlane(Vector3d::UnitZ(), &m));
  EXPECT_FALSE(HarmonicConjugate(m, Vector3d::Zero(), &v));
  EXPECT_FALSE(RotationFromCircularPoints(m, Vector3d::UnitZ(), &R));
  EXPECT_TRUE(std::isinf(HarmonicDeviation(m, Vector3d::UnitZ(), Vector3d::UnitX())));
  FrameRotation frame;
  EXPECT_FALSE(RotationFromFrame(m, Vector3d::UnitX(), 1.0, Vector3d::UnitZ(), 1.0, &frame));
  EXPECT_FALSE(RotationFromFrame(m, Vector3d::UnitX(), 1.0, Vector3d::UnitX(), 1.0, &frame));
}

}  // namespace
}  // namespace circline
