#include "circline/estimators/line.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include "circline/estimators/random.h"
#include "circline/estimators/vanishing_point.h"
#include "tests/basics.h"
#include "tests/pinhole_camera.h"
#include "tests/trials.h"

namespace circline {
namespace {

Camera BarrelCamera() {
  Camera camera = PinholeCamera(500.0);
  camera.model = CameraModel::kOpenCV;
  camera.distortion = {-0.28, 0.08, 0.0, 0.0, 0.0};
  return camera;
}

// Noisy pixels of the line from a to b (calibrated), seen through the camera.
std::vector<CalibratedPoint> NoisyLine(const Camera& camera, const Eigen::Vector2d& a,
                                       const Eigen::Vector2d& b, int n, double sigma_px,
                                       Random* random) {
  std::vector<CalibratedPoint> points;
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector2d x = a + (b - a) * i / (n - 1);
    Eigen::Vector2d pixel;
    CameraToPixel(camera, {x.x(), x.y(), 1.0}, &pixel);
    CalibratedPoint p;
    PixelToCalibrated(camera, pixel + Noise2(sigma_px, random), &p);
    points.push_back(p);
  }
  return points;
}

// Squared error of a unit vector without sense in units of its rank-2 covariance.
double Nees(const Eigen::Vector3d& estimate, const Eigen::Matrix3d& covariance,
            const Eigen::Vector3d& truth) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(covariance);
  const Eigen::Vector3d d = estimate - truth * (estimate.dot(truth) < 0.0 ? -1.0 : 1.0);
  const Eigen::Vector3d z = eigen.eigenvectors().transpose() * d;
  return (z.tail<2>().array().square() / eigen.eigenvalues().tail<2>().array()).sum();
}

TEST(LineTest, CovarianceIsHonestUnderDistortion) {
  const Camera camera = BarrelCamera();
  Random random(1);
  for (int n : {2, 30}) {
    constexpr int kTrials = Trials(2000);
    double nees = 0.0;
    for (int i = 0; i < kTrials; ++i) {
      const Eigen::Vector2d a{random.Uniform(-0.5, 0.0), random.Uniform(-0.4, 0.4)};
      const Eigen::Vector2d b{random.Uniform(0.1, 0.5), random.Uniform(-0.4, 0.4)};
      const Eigen::Vector3d truth = a.homogeneous().cross(b.homogeneous()).normalized();
      LineFit fit;
      ASSERT_TRUE(FitLine(NoisyLine(camera, a, b, n, 0.5, &random), 0.5, &fit).ok());
      nees += Nees(fit.line, fit.covariance, truth) / kTrials;
    }
    if (kSanitized) continue;
    EXPECT_NEAR(nees, 2.0, 0.2) << n << " points";
  }
}

TEST(LineTest, RefusesDegeneratePoints) {
  LineFit fit;
  std::vector<CalibratedPoint> points(1);
  EXPECT_EQ(FitLine(points, 1.0, &fit).code, StatusCode::kRefused);
  points.resize(5);
  for (CalibratedPoint& p : points) p.x = {0.3, 0.4};
  EXPECT_EQ(FitLine(points, 1.0, &fit).code, StatusCode::kRefused);
}

TEST(VanishingPointTest, SitsOnItsCovarianceForMixedLengths) {
  const Camera camera = BarrelCamera();
  Random random(2);
  // Directions near and far, and one parallel to the image: infinity is nothing special.
  for (const Eigen::Vector3d& raw :
       {Eigen::Vector3d(1.0, 0.2, 0.3), Eigen::Vector3d(0.1, 0.9, 0.0)}) {
    const Eigen::Vector3d direction = raw.normalized();
    constexpr int kTrials = 1000;
    double nees = 0.0;
    for (int i = 0; i < kTrials; ++i) {
      std::vector<LineFit> lines;
      while (lines.size() < 8) {
        const Eigen::Vector3d start{random.Uniform(-0.3, 0.3), random.Uniform(-0.3, 0.3), 1.0};
        const Eigen::Vector3d end = start + random.Uniform(0.05, 0.4) * direction;
        LineFit fit;
        const auto points =
            NoisyLine(camera, start.hnormalized(), end.hnormalized(), 2, 0.3, &random);
        if (FitLine(points, 0.3, &fit).ok()) lines.push_back(fit);
      }
      VanishingPointFit fit;
      ASSERT_TRUE(FitVanishingPoint(lines, &fit).ok());
      nees += Nees(fit.direction, fit.covariance, direction) / kTrials;
    }
    EXPECT_NEAR(nees, 2.0, 0.3);
  }
}

// One scene, seen again and again: the spread of the directions against the Cramér-Rao bound, which
// is that of noise-free lines with the covariance of noisy ones.
TEST(VanishingPointTest, SitsOnTheBoundForMixedLengths) {
  const Camera camera = BarrelCamera();
  Random random(3);
  for (const std::size_t count : {3U, 10U, 40U}) {
    const Eigen::Vector3d direction = Eigen::Vector3d(1.0, 0.2, 0.3).normalized();
    std::vector<std::array<Eigen::Vector2d, 2>> segments;
    std::vector<LineFit> exact(count);
    for (LineFit& line : exact) {
      // Every other segment is ten times as long as the rest.
      const double length = segments.size() % 2 == 0 ? 0.4 : 0.04;
      const Eigen::Vector3d start{random.Uniform(-0.3, 0.1), random.Uniform(-0.3, 0.3), 1.0};
      segments.push_back({start.hnormalized(), (start + length * direction).eval().hnormalized()});
      ASSERT_TRUE(
          FitLine(NoisyLine(camera, segments.back()[0], segments.back()[1], 2, 0.0, &random), 0.3,
                  &line)
              .ok());
    }
    VanishingPointFit bound;
    ASSERT_TRUE(FitVanishingPoint(exact, &bound).ok());
    constexpr int kTrials = Trials(2000);
    double square = 0.0;
    for (int i = 0; i < kTrials; ++i) {
      std::vector<LineFit> lines(count);
      for (std::size_t k = 0; k < count; ++k) {
        const auto points = NoisyLine(camera, segments[k][0], segments[k][1], 2, 0.3, &random);
        ASSERT_TRUE(FitLine(points, 0.3, &lines[k]).ok());
      }
      VanishingPointFit fit;
      ASSERT_TRUE(FitVanishingPoint(lines, &fit).ok());
      square += fit.direction.cross(direction).squaredNorm() / kTrials;
    }
    if (kSanitized) continue;
    const double ratio = std::sqrt(square / bound.covariance.trace());
    std::printf("%2zu lines: rms / bound %.3f\n", count, ratio);
    EXPECT_LE(ratio, 1.05) << count;  // 2000 trials scatter it by 1.6 %.
    EXPECT_GE(ratio, 0.95) << count;
  }
}

TEST(VanishingPointTest, RefusesOneLineManyTimes) {
  LineFit line;
  line.line = Eigen::Vector3d(0.6, 0.8, 0.0);
  line.covariance = 1e-6 * (Eigen::Matrix3d::Identity() - line.line * line.line.transpose());
  VanishingPointFit fit;
  EXPECT_EQ(FitVanishingPoint({line}, &fit).code, StatusCode::kRefused);
  EXPECT_EQ(FitVanishingPoint({line, line, line}, &fit).code, StatusCode::kRefused);
}

}  // namespace
}  // namespace circline
