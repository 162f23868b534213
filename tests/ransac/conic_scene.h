// Contours among clutter, for the tests of robust conics.
#ifndef CIRCLINE_TESTS_RANSAC_CONIC_SCENE_H_
#define CIRCLINE_TESTS_RANSAC_CONIC_SCENE_H_

#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/conic.h"
#include "circline/estimators/random.h"
#include "circline/ransac/conic_model.h"
#include "tests/pinhole_camera.h"

namespace circline::conic_scene {

inline Camera TestCamera() { return PinholeCamera(); }

enum class Clutter { kUniform, kEllipse, kEdge, kCluster };

// 100 points of an ellipse with semi-axes 100 and 60 px, sigma 1 px, and outliers in 1.5 times its
// bounding box.
struct Scene {
  std::vector<CalibratedPoint> points;  // The contour first, then the clutter.
  std::vector<CalibratedPoint> truth;   // The contour without noise.
  EdgeDirections directions;            // Of the points, with sigma 0.1 rad; any for the clutter.

  // RMS error of a curve along the true contour in units of the Cramer-Rao bound (5 parameters).
  double Error(const Eigen::Matrix3d& conic) const {
    double sum = 0.0;
    for (const CalibratedPoint& p : truth) {
      const double d = ConicDistancePx(p, conic);
      sum += d * d;
    }
    return std::sqrt(sum / 5.0);
  }
};

inline Scene MakeScene(std::uint64_t seed, double outlier_ratio, double arc_deg = 360.0,
                       Clutter clutter = Clutter::kUniform, double sigma = 1.0) {
  Random random(seed);
  Ellipse ellipse;
  ellipse.center = {320.0, 240.0};
  ellipse.a = 100.0;
  ellipse.b = 60.0;
  ellipse.angle = random.Uniform(-1.5, 1.5);
  const auto noise = [&] {
    const double x = random.Normal(), y = random.Normal();
    return Eigen::Vector2d(sigma * x, sigma * y);
  };
  // Of an ellipse's edge, unit length, turned by noise; from a generator of their own.
  Random turns(seed + 1000000);
  const auto normal_of = [&](const Ellipse& e, double t) {
    const Eigen::Vector2d local(std::cos(t) / e.a, std::sin(t) / e.b);
    return Eigen::Vector2d(Eigen::Rotation2Dd(e.angle + 0.1 * turns.Normal()) * local.normalized());
  };
  std::vector<Eigen::Vector2d> truth, pixels, normals;
  const double start = random.Uniform(0.0, 2.0 * kPi);
  for (int i = 0; i < 100; ++i) {
    const double t = start + arc_deg * kDegree * i / 100.0;
    truth.push_back(EllipsePoint(ellipse, t));
    normals.push_back(normal_of(ellipse, t));
    pixels.push_back(truth.back() + noise());
  }
  Eigen::Vector2d half = Eigen::Vector2d::Zero();
  for (int i = 0; i < 360; ++i) {
    half = half.cwiseMax((EllipsePoint(ellipse, i * kDegree) - ellipse.center).cwiseAbs());
  }
  half *= 1.5;
  const auto in_box = [&] {
    const double x = random.Uniform(-1.0, 1.0), y = random.Uniform(-1.0, 1.0);
    return Eigen::Vector2d(ellipse.center + half.cwiseProduct(Eigen::Vector2d(x, y)));
  };
  Ellipse other;
  other.center = ellipse.center + Eigen::Vector2d(60.0, -40.0);
  other.a = 80.0;
  other.b = 50.0;
  other.angle = random.Uniform(-1.5, 1.5);
  const double edge_angle = random.Uniform(0.0, kPi);
  const Eigen::Vector2d along(std::cos(edge_angle), std::sin(edge_angle));
  const Eigen::Vector2d cluster = in_box();
  const int num_outliers =
      static_cast<int>(std::lround(100.0 * outlier_ratio / (1.0 - outlier_ratio)));
  for (int i = 0; i < num_outliers; ++i) {
    const double any = turns.Uniform(0.0, kPi);
    normals.emplace_back(std::cos(any), std::sin(any));
    if (clutter == Clutter::kUniform) pixels.push_back(in_box());
    if (clutter == Clutter::kEllipse) {
      const double t = random.Uniform(0.0, 2.0 * kPi);
      pixels.push_back(EllipsePoint(other, t) + noise());
      normals.back() = normal_of(other, t);
    }
    if (clutter == Clutter::kEdge) {
      pixels.push_back(ellipse.center + Eigen::Vector2d(20.0, 10.0) +
                       random.Uniform(-150.0, 150.0) * along + noise());
      normals.back() = {-along.y(), along.x()};
    }
    if (clutter == Clutter::kCluster) {
      const double r = 15.0 * std::sqrt(random.Uniform()), t = random.Uniform(0.0, 2.0 * kPi);
      pixels.push_back(cluster + r * Eigen::Vector2d(std::cos(t), std::sin(t)));
    }
  }
  Scene scene;
  scene.directions.normals = normals;
  PixelsToCalibrated(TestCamera(), pixels, &scene.points);
  PixelsToCalibrated(TestCamera(), truth, &scene.truth);
  return scene;
}

}  // namespace circline::conic_scene

#endif  // CIRCLINE_TESTS_RANSAC_CONIC_SCENE_H_
