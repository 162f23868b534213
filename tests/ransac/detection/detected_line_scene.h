// Lines as detection finds them, made to order.
#ifndef CIRCLINE_TESTS_RANSAC_DETECTION_DETECTED_LINE_SCENE_H_
#define CIRCLINE_TESTS_RANSAC_DETECTION_DETECTED_LINE_SCENE_H_

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/random.h"
#include "circline/ransac/detection/lines/detect_lines.h"
#include "circline/ransac/detection/structure/observe_evidence.h"
#include "tests/ransac/detection/detection_test_util.h"

namespace circline::detection_test {

// The image line between two pixels, its points moved by noise of `sigma` pixels.
inline DetectedLine LineThrough(const Camera& camera, const Eigen::Vector2d& from,
                                const Eigen::Vector2d& to, double sigma, Random* random) {
  DetectedLine line;
  line.length_px = (to - from).norm();
  const Eigen::Vector2d along = (to - from) / line.length_px, across(-along.y(), along.x());
  std::vector<CalibratedPoint> points;
  for (double s = 0.0; s <= line.length_px; s += 5.0) {
    line.points.push_back(from + s * along + sigma * random->Normal() * across);
    CalibratedPoint p;
    EXPECT_TRUE(PixelToCalibrated(camera, line.points.back(), &p));
    points.push_back(p);
  }
  line.ends = {line.points.front(), line.points.back()};
  line.sigma_px = sigma;
  EXPECT_TRUE(FitLine(points, sigma, &line.fit).ok());
  return line;
}

// An image line of `length` pixels through (u, v), towards the vanishing point of `direction`
// turned by `turn` radians, its points moved by noise of `sigma` pixels.
inline DetectedLine MakeLine(const Camera& camera, double u, double v,
                             const Eigen::Vector3d& direction, double length, double turn,
                             double sigma, Random* random) {
  CalibratedPoint middle;
  EXPECT_TRUE(PixelToCalibrated(camera, Eigen::Vector2d(u, v), &middle));
  const Eigen::Vector2d to_vp = direction.head<2>() - direction.z() * middle.x;
  const double angle = std::atan2(to_vp.y(), to_vp.x()) + turn;
  const Eigen::Vector2d half = 0.5 * length * Eigen::Vector2d(std::cos(angle), std::sin(angle));
  return LineThrough(camera, Eigen::Vector2d(u, v) - half, Eigen::Vector2d(u, v) + half, sigma,
                     random);
}

// Adds an edge of `length` pixels along the direction, somewhere in TestCamera()'s photo, as a
// detection through another camera has it.
inline void AddEdge(const Eigen::Vector3d& direction, double length, const Camera& through,
                    Random* random, PhotoEvidence* evidence) {
  const double u = random->Uniform(120.0, 360.0), v = random->Uniform(80.0, 260.0);
  const DetectedLine line = MakeLine(TestCamera(), u, v, direction, length, 0.0, 0.1, random);
  EXPECT_TRUE(LineFromSegment(through, line.ends, 0.1, &evidence->lines.emplace_back()).ok());
}

// The nine edges that one sees of a box of 165 x 68 x 80 at a distance of 500, its axes the columns
// of `axes` (camera frame).
inline std::vector<DetectedLine> BoxEdges(const Camera& camera, const Eigen::Matrix3d& axes,
                                          double sigma, Random* random) {
  const auto corner = [&](int i) -> Eigen::Vector3d {
    const Eigen::Vector3d at(165.0 * ((i & 1) - 0.5), 68.0 * ((i >> 1 & 1) - 0.5),
                             80.0 * ((i >> 2 & 1) - 0.5));
    return axes * at + Eigen::Vector3d(0.0, 0.0, 500.0);
  };
  int hidden = 0;  // The corner farthest from the camera.
  for (int i = 1; i < 8; ++i) {
    if (corner(i).norm() > corner(hidden).norm()) hidden = i;
  }
  std::vector<DetectedLine> lines;
  for (int i = 0; i < 8; ++i) {
    for (const int j : {i | 1, i | 2, i | 4}) {
      if (j == i || i == hidden || j == hidden) continue;
      Eigen::Vector2d from, to;
      EXPECT_TRUE(CameraToPixel(camera, corner(i), &from) && CameraToPixel(camera, corner(j), &to));
      lines.push_back(LineThrough(camera, from, to, sigma, random));
    }
  }
  return lines;
}

}  // namespace circline::detection_test

#endif  // CIRCLINE_TESTS_RANSAC_DETECTION_DETECTED_LINE_SCENE_H_
