// A circle and a pencil with stray points, through a lens.
#ifndef CIRCLINE_TESTS_RANSAC_STRAY_POINTS_SCENE_H_
#define CIRCLINE_TESTS_RANSAC_STRAY_POINTS_SCENE_H_

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <string>
#include <vector>

#include "circline/estimators/observations.h"
#include "circline/estimators/random.h"
#include "circline/ransac/fit_observations.h"
#include "tests/pinhole_camera.h"

namespace circline::stray_points_scene {

inline Camera TestCamera() {
  Camera camera = PinholeCamera();
  camera.model = CameraModel::kOpenCV;
  camera.distortion = {-0.2, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  return camera;
}

inline Eigen::Vector2d Pixel(double x, double y, Random* noise = nullptr, double sigma = 0.0) {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  EXPECT_TRUE(CameraToPixel(TestCamera(), {x, y, 1.0}, &pixel));
  if (noise != nullptr) {
    const double nx = noise->Normal(), ny = noise->Normal();
    pixel += sigma * Eigen::Vector2d(nx, ny);
  }
  return pixel;
}

// A circle with one stray point in four and one pixel no camera sees, and a pencil of five lines,
// of which one is stray and one has a stray point.
inline Observations MakeObservations() {
  Observations observations;
  observations.camera = TestCamera();
  Random random(1);
  CircleObservation circle;
  circle.id = "c0";
  circle.sigma_px = 0.3;
  for (int i = 0; i < 60; ++i) {
    const double t = 0.1 * i;
    const bool stray = i % 4 == 3;
    const Eigen::Vector2d anywhere{random.Uniform(-0.2, 0.2), random.Uniform(-0.2, 0.2)};
    circle.points.push_back(
        stray ? Pixel(anywhere.x(), anywhere.y())
              : Pixel(0.05 + 0.1 * std::cos(t), 0.07 * std::sin(t), &random, 0.3));
  }
  circle.points.emplace_back(1e12, 1e12);
  observations.circles.push_back(circle);
  PencilObservation pencil;
  pencil.id = "L1";
  pencil.sigma_px = 0.3;
  const Eigen::Vector2d vanishing_point(0.9, 0.2);
  for (int i = 0; i < 5; ++i) {
    const Eigen::Vector2d from(-0.3, -0.2 + 0.1 * i);
    const Eigen::Vector2d to =
        i == 3 ? Eigen::Vector2d(0.1, -0.25) : Eigen::Vector2d(0.6 * from + 0.4 * vanishing_point);
    LineObservation line;
    for (int k = 0; k <= 6; ++k) {
      const Eigen::Vector2d x = from + (to - from) * k / 6.0;
      line.points.push_back(Pixel(x.x(), x.y(), &random, 0.3));
    }
    if (i == 1) line.points[3].y() += 20.0;
    if (i == 2) line.points = {line.points.front(), line.points.back()};
    pencil.lines.push_back(line);
  }
  observations.pencils.push_back(pencil);
  return observations;
}

// Fits, and returns the problems that are reported.
inline std::vector<std::string> FitProblems(Observations* observations,
                                            const FitOptions& options = FitOptions()) {
  std::vector<std::string> problems;
  EXPECT_TRUE(FitObservations(options, observations, &problems).ok());
  return problems;
}

// Squared error in standard deviations, in the `rank` directions of a covariance that has them.
inline double SquaredError(const Eigen::MatrixXd& covariance, const Eigen::VectorXd& error,
                           int rank) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance);
  const Eigen::VectorXd along = eigen.eigenvectors().transpose() * error;
  return (along.array().square() / eigen.eigenvalues().array()).tail(rank).sum();
}

}  // namespace circline::stray_points_scene

#endif  // CIRCLINE_TESTS_RANSAC_STRAY_POINTS_SCENE_H_
