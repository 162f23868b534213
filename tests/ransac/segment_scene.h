// Segments along given directions among clutter, for the tests and benchmarks of pencils.
#ifndef CIRCLINE_TESTS_RANSAC_SEGMENT_SCENE_H_
#define CIRCLINE_TESTS_RANSAC_SEGMENT_SCENE_H_

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/line.h"
#include "circline/estimators/random.h"
#include "tests/basics.h"
#include "tests/pinhole_camera.h"

namespace circline::segment_scene {

inline Eigen::Matrix3d RandomRotation(Random* random) {
  const double w = random->Normal(), x = random->Normal(), y = random->Normal(),
               z = random->Normal();
  return Eigen::Quaterniond(w, x, y, z).normalized().toRotationMatrix();
}

// The image of a direction at a pixel, a unit vector.
inline Eigen::Vector2d ImageOf(const Eigen::Vector3d& direction, const Eigen::Vector2d& pixel) {
  const Camera camera = PinholeCamera();
  const Eigen::Vector3d x((pixel.x() - camera.cx) / camera.fx, (pixel.y() - camera.cy) / camera.fy,
                          1.0);
  return (direction - direction.z() * x).head<2>().normalized();
}

// Adds a segment, end points with sigma 0.5 px, seen by PinholeCamera.
inline void AddSegment(const Eigen::Vector2d& middle, const Eigen::Vector2d& along, double half,
                       Random* random, std::vector<LineFit>* lines) {
  constexpr double kSigma = 0.5;
  std::vector<Eigen::Vector2d> ends = {middle, middle};
  for (std::size_t i = 0; i < 2; ++i) {
    ends[i] = ends[i] + (i == 0 ? half : -half) * along + Noise2(kSigma, random);
  }
  std::vector<CalibratedPoint> points;
  PixelsToCalibrated(PinholeCamera(), ends, &points);
  LineFit fit;
  if (FitLine(points, kSigma, &fit).ok()) lines->push_back(fit);
}

// One of 20 to 120 px anywhere in the photo, along the image of `direction` or, where that is null,
// any way.
inline void AddSegment(const Eigen::Vector3d* direction, Random* random,
                       std::vector<LineFit>* lines) {
  const Camera camera = PinholeCamera();
  const double u = random->Uniform(0.0, camera.width), v = random->Uniform(0.0, camera.height);
  const double angle = random->Uniform(0.0, kPi);
  const Eigen::Vector2d along = direction != nullptr
                                    ? ImageOf(*direction, {u, v})
                                    : Eigen::Vector2d(std::cos(angle), std::sin(angle));
  AddSegment({u, v}, along, random->Uniform(10.0, 60.0), random, lines);
}

// Lines of 30 px in a corner of the photo, all about as far off `direction`, 5 to 8 degrees.
inline std::vector<LineFit> DriftedLines(const Eigen::Vector3d& direction, int number,
                                         Random* random) {
  std::vector<LineFit> lines;
  const double off = random->Uniform(5.0, 8.0) * kDegree;
  for (int i = 0; i < number; ++i) {
    const double u = random->Uniform(500.0, 620.0), v = random->Uniform(20.0, 100.0);
    const double turn = off + 0.3 * kDegree * random->Normal();
    AddSegment({u, v}, Eigen::Rotation2Dd(turn) * ImageOf(direction, {u, v}), 15.0, random, &lines);
  }
  return lines;
}

// So many lines along `direction`, and others any way.
inline std::vector<LineFit> Lines(const Eigen::Vector3d& direction, int along, int stray,
                                  Random* random) {
  std::vector<LineFit> lines;
  for (int i = 0; i < along + stray; ++i)
    AddSegment(i < along ? &direction : nullptr, random, &lines);
  return lines;
}

inline std::vector<LineFit> StrayLines(int number, Random* random) {
  return Lines(Eigen::Vector3d::UnitX(), 0, number, random);
}

inline double AngleBetween(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::asin(std::min(1.0, a.cross(b).norm()));
}

}  // namespace circline::segment_scene

#endif  // CIRCLINE_TESTS_RANSAC_SEGMENT_SCENE_H_
