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

// Adds a segment of 20 to 120 px anywhere in a photo of 640 x 480, end points with sigma 0.5 px,
// along the image of `direction` or, where that is null, any way.
inline void AddSegment(const Eigen::Vector3d* direction, Random* random,
                       std::vector<LineFit>* lines) {
  const Camera camera = PinholeCamera();
  const double u = random->Uniform(0.0, camera.width), v = random->Uniform(0.0, camera.height);
  const double angle = random->Uniform(0.0, kPi);
  Eigen::Vector2d along(std::cos(angle), std::sin(angle));
  if (direction != nullptr) {
    const Eigen::Vector3d x((u - camera.cx) / camera.fx, (v - camera.cy) / camera.fy, 1.0);
    along = (*direction - direction->z() * x).head<2>().normalized();
  }
  constexpr double kSigma = 0.5;
  const double half = random->Uniform(10.0, 60.0);
  std::vector<Eigen::Vector2d> ends = {{u, v}, {u, v}};
  for (std::size_t i = 0; i < 2; ++i) {
    ends[i] = ends[i] + (i == 0 ? half : -half) * along + Noise2(kSigma, random);
  }
  std::vector<CalibratedPoint> points;
  PixelsToCalibrated(camera, ends, &points);
  LineFit fit;
  if (FitLine(points, kSigma, &fit).ok()) lines->push_back(fit);
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
