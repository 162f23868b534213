// A plane seen by a camera of unknown focal length, as the closed forms take it: coordinates in
// units of a guess.
#ifndef CIRCLINE_TESTS_ESTIMATORS_FOCAL_SCENE_H_
#define CIRCLINE_TESTS_ESTIMATORS_FOCAL_SCENE_H_

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <utility>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/circle_pose.h"
#include "circline/estimators/conic_fit.h"
#include "circline/estimators/line.h"
#include "circline/estimators/random.h"
#include "circline/estimators/vanishing_point.h"
#include "tests/basics.h"
#include "tests/trials.h"

namespace circline {

inline constexpr double kGuess = 800.0;  // Pixels: the length that the coordinates are in units of.
inline constexpr double kMinFocal = 0.35, kMaxFocal = 7.0;
inline constexpr double kSigma = 0.1;  // Pixels: small, so that first order holds.

// How many a test draws: CIRCLINE_FOCAL_SCENES, else so many.
inline int NumScenes(int number) { return Trials("CIRCLINE_FOCAL_SCENES", number); }

// A plane seen by a camera whose focal length is half to twice the guess.
struct FocalScene {
  double focal;
  // cam_from_world of the plane Z = 0 at distance 10 along the optical axis.
  Eigen::Matrix3d rotation;
  Eigen::Vector3d origin{0.0, 0.0, 10.0};

  FocalScene(Random* random, double min_tilt_deg = 10.0, double max_tilt_deg = 70.0)
      : focal(std::exp2(random->Uniform(-1.0, 1.0))) {
    const double tilt = random->Uniform(min_tilt_deg, max_tilt_deg) * kDegree;
    const double about = random->Uniform(-kPi, kPi), spin = random->Uniform(-kPi, kPi);
    const Eigen::AngleAxisd tilted(tilt, Eigen::Vector3d(std::cos(about), std::sin(about), 0.0));
    rotation = tilted.toRotationMatrix() *
               Eigen::AngleAxisd(spin, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  }

  Eigen::Vector3d K() const { return {focal, focal, 1.0}; }
  Eigen::Vector3d At(double x, double y) const {
    return origin + x * rotation.col(0) + y * rotation.col(1);
  }
  Eigen::Vector3d Point(double x, double y) const { return K().cwiseProduct(At(x, y)); }
  Eigen::Vector3d Direction(const Eigen::Vector3d& world) const {
    return K().cwiseProduct(rotation * world).normalized();
  }
  ConicFit Conic(double x, double y, double radius) const {
    CirclePose pose;
    pose.center = At(x, y) / radius;
    pose.normal = rotation.col(2);
    const Eigen::Vector3d inverse = K().cwiseInverse();
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
  static CalibratedPoint Noisy(const Eigen::Vector3d& point, double sigma_px, Random* random) {
    CalibratedPoint p;
    p.x = point.hnormalized() + Noise2(sigma_px / kGuess, random);
    p.x_from_pixel = {1.0 / kGuess, 0.0, 0.0, 1.0 / kGuess};
    return p;
  }
  VanishingPointFit NoisyPencil(const Eigen::Vector3d& world, double sigma_px,
                                Random* random) const {
    std::vector<LineFit> lines;
    const Eigen::Vector3d across = world.unitOrthogonal(), other = world.cross(across);
    for (const auto& [u, v] : {std::pair(-2.0, 1.0), {2.0, 1.0}, {-2.0, -1.0}, {2.0, -1.0}}) {
      std::vector<CalibratedPoint> points;
      for (int i = -5; i <= 5; ++i) {
        const Eigen::Vector3d X = origin + rotation * (0.4 * i * world + u * across + v * other);
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

inline VanishingPointFit ExactDirection(const Eigen::Vector3d& direction) {
  VanishingPointFit fit;
  fit.direction = direction;
  return fit;
}

}  // namespace circline

#endif  // CIRCLINE_TESTS_ESTIMATORS_FOCAL_SCENE_H_
