// A box with faces of different brightness, painted as a camera sees it.
#ifndef CIRCLINE_TESTS_APPS_PAINTED_BOX_H_
#define CIRCLINE_TESTS_APPS_PAINTED_BOX_H_

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

#include "circline/estimators/camera.h"
#include "circline/estimators/pose.h"
#include "tests/apps/board_set.h"
#include "tests/pinhole_camera.h"

namespace circline::apps {

// From (0, 0, 0) to `size`, z up; seen by a pinhole camera of 640 x 480 pixels from above, so that
// the faces at x = 0, y = 0 and the upper one are seen.
struct PaintedBox {
  static constexpr double kFocal = 700.0;
  static constexpr int kWidth = 640, kHeight = 480;
  static constexpr int kAround = 30, kTop = 220, kFaceX = 90, kFaceY = 150;

  Eigen::Vector3d size{0.9, 0.6, 0.4};
  CameraPose pose;

  PaintedBox() {
    const Eigen::Vector3d eye(-1.3, -1.9, 1.7), at = 0.5 * size;
    const Eigen::Vector3d z = (at - eye).normalized(),
                          x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
    pose.rotation << x.transpose(), z.cross(x).transpose(), z.transpose();
    pose.translation = -(pose.rotation * eye);
  }

  Camera camera() const {
    Camera camera = CenteredCamera(kFocal, kWidth, kHeight);
    camera.id = "k";
    return camera;
  }
  std::string CameraText() const {
    return "cameras:\n  - { id: \"k\", model: \"pinhole\", width: 640, height: 480, camera_matrix: "
           "[700., 0., 319.5, 0., 700., 239.5, 0., 0., 1.] }\n";
  }
  Eigen::Vector2d Pixel(const Eigen::Vector3d& x) const {
    Eigen::Vector2d pixel(0.0, 0.0);
    CameraToPixel(camera(), pose.rotation * x + pose.translation, &pixel);
    return pixel;
  }
  // Of the corner at these shares of the size.
  Eigen::Vector2d Corner(double x, double y, double z) const {
    return Pixel(size.cwiseProduct(Eigen::Vector3d(x, y, z)));
  }
  Eigen::Vector3d Eye() const { return -(pose.rotation.transpose() * pose.translation); }
  Eigen::Vector3d Ray(double u, double v) const {
    return pose.rotation.transpose() *
           Eigen::Vector3d((u - 319.5) / kFocal, (v - 239.5) / kFocal, 1.0);
  }
  int Brightness(double u, double v) const {
    const Eigen::Vector3d eye = Eye(), ray = Ray(u, v);
    double nearest = std::numeric_limits<double>::infinity();
    int seen = kAround;
    const std::array<double, 3> at = {0.0, 0.0, size.z()};
    const std::array<int, 3> brightness = {kFaceX, kFaceY, kTop};
    for (int k = 0; k < 3; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const double share = (at[i] - eye[k]) / ray[k];
      const Eigen::Vector3d hit = eye + share * ray;
      bool inside = share > 0.0 && share < nearest;
      for (int j = 0; j < 3; ++j) inside = inside && (j == k || (hit[j] > 0.0 && hit[j] < size[j]));
      if (!inside) continue;
      nearest = share;
      seen = brightness[i];
    }
    return seen;
  }
  void Paint(const std::string& path) const {
    PaintPhoto(path, kWidth, kHeight, 4, [this](double u, double v) { return Brightness(u, v); });
  }
};

}  // namespace circline::apps

#endif  // CIRCLINE_TESTS_APPS_PAINTED_BOX_H_
