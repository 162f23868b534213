// The scene of the paper's simulation (docs/paper.md): a circle in a square of two
// orthogonal pairs of parallel lines, seen by a camera of focal length 1800 from 100 units away.
#ifndef CIRCLINE_TESTS_PAPER_SCENE_H_
#define CIRCLINE_TESTS_PAPER_SCENE_H_

#include <Eigen/Core>
#include <cmath>

#include "circline/estimators/basics.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/random.h"
#include "tests/basics.h"

namespace circline {

// Cramer-Rao bounds of the total rotation angle for this scene, rad per px of noise
// (docs/paper.md).
constexpr double kBoundCircleFrame = 0.00389;
constexpr double kBoundLines = 0.00800;
constexpr double kBoundJoint = 0.00336;

inline Camera PaperCamera() {
  Camera camera;
  camera.fx = camera.fy = 1800.0;
  return camera;
}

inline CameraPose PaperPose() {
  CameraPose pose;
  pose.rotation = ExpRotation(0.84 * Eigen::Vector3d(0.717, 0.359, 0.598).normalized());
  pose.translation = Eigen::Vector3d(2.0, 2.0, 100.0);
  return pose;
}

// Image of a point of the plane Z = 0 with noise of `sigma_px` on both coordinates.
inline Eigen::Vector2d PaperPixel(double x, double y, double sigma_px, Random* random) {
  const CameraPose pose = PaperPose();
  Eigen::Vector2d pixel;
  CameraToPixel(PaperCamera(), pose.rotation * Eigen::Vector3d(x, y, 0.0) + pose.translation,
                &pixel);
  return pixel + Noise2(sigma_px, random);
}

inline LineObservation PaperLine(double x0, double y0, double x1, double y1, double sigma_px,
                                 Random* random) {
  LineObservation line;
  constexpr int kPoints = 50;
  for (int i = 0; i < kPoints; ++i) {
    const double s = static_cast<double>(i) / (kPoints - 1);
    line.points.push_back(PaperPixel(x0 + s * (x1 - x0), y0 + s * (y1 - y0), sigma_px, random));
  }
  return line;
}

// L11 (y = 0) is the X axis and L21 (x = 0) the Y axis, both oriented.
inline Observations PaperScene(double sigma_px, Random* random) {
  const double sigma = sigma_px > 0.0 ? sigma_px : 1e-3;
  Observations observations;
  observations.camera = PaperCamera();
  CircleObservation circle;
  circle.id = "c0";
  circle.plane = "p0";
  circle.sigma_px = sigma;
  constexpr int kPoints = 100;
  for (int i = 0; i < kPoints; ++i) {
    const double a = 2.0 * kPi * i / kPoints;
    circle.points.push_back(
        PaperPixel(10.0 + 7.0 * std::cos(a), 10.0 + 7.0 * std::sin(a), sigma_px, random));
  }
  observations.circles = {circle};
  PencilObservation x, y;
  x.id = "L1";
  x.direction = PencilDirection::kX;
  x.lines = {PaperLine(0, 0, 20, 0, sigma_px, random), PaperLine(0, 20, 20, 20, sigma_px, random)};
  y.id = "L2";
  y.direction = PencilDirection::kY;
  y.lines = {PaperLine(0, 0, 0, 20, sigma_px, random), PaperLine(20, 0, 20, 20, sigma_px, random)};
  x.plane = y.plane = "p0";
  x.sigma_px = y.sigma_px = sigma;
  observations.pencils = {x, y};
  observations.frame.plane = "p0";
  observations.frame.x_axis = Segment{x.lines[0].points.front(), x.lines[0].points.back()};
  observations.frame.y_axis = Segment{y.lines[0].points.front(), y.lines[0].points.back()};
  return observations;
}

}  // namespace circline

#endif  // CIRCLINE_TESTS_PAPER_SCENE_H_
