// Lines as detection finds them, made to order.
#ifndef CIRCLINE_TESTS_RANSAC_DETECTED_LINE_SCENE_H_
#define CIRCLINE_TESTS_RANSAC_DETECTED_LINE_SCENE_H_

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/random.h"
#include "circline/ransac/detect_lines.h"

namespace circline::detection_test {

// An image line of `length` pixels through (u, v), towards the vanishing point of `direction`
// turned by `turn` radians, its points moved by noise of `sigma` pixels.
inline DetectedLine MakeLine(const Camera& camera, double u, double v,
                             const Eigen::Vector3d& direction, double length, double turn,
                             double sigma, Random* random) {
  CalibratedPoint middle;
  EXPECT_TRUE(PixelToCalibrated(camera, Eigen::Vector2d(u, v), &middle));
  const Eigen::Vector2d to_vp = direction.head<2>() - direction.z() * middle.x;
  const double angle = std::atan2(to_vp.y(), to_vp.x()) + turn;
  const Eigen::Vector2d along(std::cos(angle), std::sin(angle)), across(-along.y(), along.x());
  DetectedLine line;
  std::vector<CalibratedPoint> points;
  for (double s = -0.5 * length; s <= 0.5 * length; s += 5.0) {
    line.points.push_back(Eigen::Vector2d(u, v) + s * along + sigma * random->Normal() * across);
    CalibratedPoint p;
    EXPECT_TRUE(PixelToCalibrated(camera, line.points.back(), &p));
    points.push_back(p);
  }
  line.ends = {line.points.front(), line.points.back()};
  line.length_px = length;
  line.sigma_px = sigma;
  EXPECT_TRUE(FitLine(points, sigma, &line.fit).ok());
  return line;
}

}  // namespace circline::detection_test

#endif  // CIRCLINE_TESTS_RANSAC_DETECTED_LINE_SCENE_H_
