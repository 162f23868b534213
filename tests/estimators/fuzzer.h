// Inputs of free functions, good and strange.
#ifndef CIRCLINE_TESTS_ESTIMATORS_FUZZER_H_
#define CIRCLINE_TESTS_ESTIMATORS_FUZZER_H_

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/circle_pose.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/random.h"

namespace circline {

// Draws inputs. Each one is bad in its own way: how likely a number is to be strange is drawn once
// an input, so that many inputs are strange in one place only, and some are not at all.
class Fuzzer {
 public:
  explicit Fuzzer(std::uint64_t seed) : random(seed) {}

  void NextInput() {
    constexpr double kStrange[] = {0.0, 0.0, 0.05, 0.3, 1.0};
    strange_ = kStrange[random.UniformInt(5)];
    scale_ = random.Uniform() < 0.3 ? std::pow(10.0, random.Uniform(-320.0, 308.0)) : 1.0;
    shape_ = random.UniformInt(6);
  }

  double Number() {
    if (random.Uniform() >= strange_) return scale_ * random.Uniform(-1.0, 1.0);
    using Limits = std::numeric_limits<double>;
    const double sign = random.Uniform() < 0.5 ? -1.0 : 1.0;
    switch (random.UniformInt(10)) {
      case 0:
        return Limits::quiet_NaN();
      case 1:
        return sign * Limits::infinity();
      case 2:
        return sign * Limits::max();
      case 3:
        return sign * Limits::min();
      case 4:
        return sign * Limits::denorm_min();
      case 5:
        return sign * std::pow(10.0, random.Uniform(-320.0, 308.0));
      case 6:
        return sign * 0.0;
      case 7:
        return sign * 1.0;
      case 8:
        return sign * Limits::epsilon();
      default:
        return sign * 1e200;
    }
  }
  Eigen::Vector2d Vector2() {
    const double x = Number(), y = Number();
    return {x, y};
  }
  Eigen::Vector3d Vector3() {
    const double x = Number(), y = Number(), z = Number();
    return {x, y, z};
  }
  // Any, symmetric, of low rank, diagonal, or the image of a circle.
  Eigen::Matrix3d Conic() {
    const Eigen::Vector3d a = Vector3(), b = Vector3(), c = Vector3();
    switch (shape_) {
      case 0:
        return a * b.transpose() + b * a.transpose();
      case 1:
        return a * a.transpose();
      case 2:
        return Eigen::Matrix3d(a.asDiagonal());
      case 3:
        return ProjectCircle({a, Eigen::Vector3d(b.x(), b.y(), 3.0)});
      default: {
        Eigen::Matrix3d C;
        C << a, b, c;
        return shape_ == 4 ? C : Eigen::Matrix3d(0.5 * (C + C.transpose()));
      }
    }
  }
  // On an ellipse, collinear, repeated, or anywhere.
  std::vector<CalibratedPoint> Points() {
    std::vector<CalibratedPoint> points(static_cast<std::size_t>(random.UniformInt(24)));
    const Eigen::Vector2d a = Vector2(), b = Vector2();
    for (std::size_t i = 0; i < points.size(); ++i) {
      const double t = random.Uniform(0.0, 2.0 * kPi);
      switch (shape_) {
        case 0:
          points[i].x = a + t * b;
          break;
        case 1:
          points[i].x = random.Uniform() < 0.7 ? a : b;
          break;
        case 2:
          points[i].x = Vector2();
          break;
        default:
          points[i].x = a + scale_ * Eigen::Vector2d(std::cos(t), 0.5 * std::sin(t));
      }
      if (random.Uniform() < 0.3 * strange_) points[i].x = Vector2();
      for (double& entry : points[i].x_from_pixel) {
        if (random.Uniform() < 0.1 * strange_) entry = Number();
      }
    }
    return points;
  }
  CameraPose Pose() {
    CameraPose pose;
    pose.rotation = ExpRotation(
        {random.Uniform(-3.0, 3.0), random.Uniform(-3.0, 3.0), random.Uniform(-3.0, 3.0)});
    pose.translation = Vector3();
    if (random.Uniform() < 0.1 * strange_) pose.rotation.col(random.UniformInt(3)) = Vector3();
    return pose;
  }

  Random random;

 private:
  double strange_ = 0.0, scale_ = 1.0;
  int shape_ = 0;
};

}  // namespace circline

#endif  // CIRCLINE_TESTS_ESTIMATORS_FUZZER_H_
