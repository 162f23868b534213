// A plane seen by a distorted camera, on which tests draw circles and lines.
#ifndef CIRCLINE_TESTS_PLANE_SCENE_H_
#define CIRCLINE_TESTS_PLANE_SCENE_H_

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string>

#include "circline/estimators/basics.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/random.h"
#include "tests/basics.h"

namespace circline {

class PlaneScene {
 public:
  // `tilt`: between the plane's normal and the direction to the camera, about, radians.
  explicit PlaneScene(double tilt = 0.7, double sigma_px = 0.0, std::uint64_t seed = 1)
      : random(seed), sigma_px_(sigma_px) {
    camera.model = CameraModel::kOpenCV;
    camera.width = 640;
    camera.height = 480;
    camera.fx = 600.0;
    camera.fy = 610.0;
    camera.cx = 322.0;
    camera.cy = 239.0;
    camera.distortion = {-0.2, 0.05, 1e-3, -5e-4, 0.0};
    // Z towards the camera, X to the right, then tilted and turned.
    pose.rotation = ExpRotation({tilt, 0.1, 0.0}) * ExpRotation({0.0, 0.0, 0.3}) *
                    Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
    pose.translation = Eigen::Vector3d(0.3, -0.2, 10.0);
  }

  Eigen::Vector2d Pixel(double x, double y, double z = 0.0) {
    Eigen::Vector2d pixel(-1e9, -1e9);
    CameraToPixel(camera, pose.rotation * Eigen::Vector3d(x, y, z) + pose.translation, &pixel);
    return pixel + Noise2(sigma_px_, &random);
  }

  // A circle that is said to be of the plane: its points are `on(0)`, `on(1)`, ..., 3-vectors.
  template <typename On>
  CircleObservation Contour(const std::string& id, int points, const On& on) {
    CircleObservation circle;
    circle.id = id;
    circle.plane = "p0";
    circle.sigma_px = sigma();
    for (int i = 0; i < points; ++i) {
      const Eigen::Vector3d X = on(i);
      circle.points.push_back(Pixel(X.x(), X.y(), X.z()));
    }
    return circle;
  }
  CircleObservation Circle(const std::string& id, double x, double y, double radius,
                           int points = 60) {
    return Contour(id, points, [=](int i) {
      const double a = 2.0 * kPi * i / points;
      return Eigen::Vector3d(x + radius * std::cos(a), y + radius * std::sin(a), 0.0);
    });
  }

  LineObservation Line(const Eigen::Vector3d& from, const Eigen::Vector3d& to, int points = 2) {
    LineObservation line;
    for (int i = 0; i < points; ++i) {
      const Eigen::Vector3d X = from + (to - from) * i / (points - 1);
      line.points.push_back(Pixel(X.x(), X.y(), X.z()));
    }
    return line;
  }

  // `lines` lines along `direction`, side by side.
  PencilObservation Pencil(const std::string& id, PencilDirection role,
                           const Eigen::Vector3d& direction, int lines = 3, int points = 2) {
    PencilObservation pencil;
    pencil.id = id;
    pencil.direction = role;
    pencil.sigma_px = sigma();
    if (direction.z() == 0.0) pencil.plane = "p0";
    const Eigen::Vector3d across = std::abs(direction.z()) > 0.5
                                       ? Eigen::Vector3d(1.0, 0.4, 0.0)
                                       : Eigen::Vector3d(-direction.y(), direction.x(), 0.0);
    for (int i = 0; i < lines; ++i) {
      const Eigen::Vector3d start = across * (2.0 * i - (lines - 1)) - 1.5 * direction;
      pencil.lines.push_back(Line(start, start + 3.0 * direction, points));
    }
    return pencil;
  }

  // Pencils along X and along Y.
  std::vector<PencilObservation> Axes(int lines = 3, int points = 2) {
    return {Pencil("L1", PencilDirection::kX, Eigen::Vector3d::UnitX(), lines, points),
            Pencil("L2", PencilDirection::kY, Eigen::Vector3d::UnitY(), lines, points)};
  }
  Observations Empty() const {
    Observations observations;
    observations.camera = camera;
    return observations;
  }

  double sigma() const { return sigma_px_ > 0.0 ? sigma_px_ : 0.1; }

  Camera camera;
  CameraPose pose;
  Random random;

 private:
  double sigma_px_;
};

// Noise-free pixels give a pose this well: the lens is inverted to 1e-10.
inline constexpr double kExact = 1e-8;

// Of the plane's normal, radians; 0 for its opposite, too.
inline double NormalError(const PoseHypothesis& h, const PlaneScene& scene) {
  return std::asin(
      std::min(1.0, h.cam_from_world.rotation.col(2).cross(scene.pose.rotation.col(2)).norm()));
}

}  // namespace circline

#endif  // CIRCLINE_TESTS_PLANE_SCENE_H_
