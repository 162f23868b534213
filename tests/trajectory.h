// A camera that moves over a plane with circles and lines: sequences for trackers.
#ifndef CIRCLINE_TESTS_TRAJECTORY_H_
#define CIRCLINE_TESTS_TRAJECTORY_H_

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/random.h"

namespace circline {

struct TrajectoryOptions {
  double noise_px = 2.0;
  double occluded = 0.2;         // Share of the frames in which nothing is seen.
  double turn_rate_sigma = 0.3;  // Random walks of the velocities, as TrackerOptions has them.
  double velocity_sigma = 0.15;
  double speed = 0.3;  // Distances a second, the first velocity; with a turn that keeps
                       // the scene in view.
  double tilt = 0.6;   // Of the first frame, radians.
  double depth = 8.0;  // Of the plane's origin, radii of the first circle.
  double fps = 30.0;
  bool second_circle = false, pencil = false;
};

// Poses by a random walk of the twist, as the tracker models it, drawn anew where the scene leaves
// the photo.
class Trajectory {
 public:
  Trajectory(const TrajectoryOptions& given, std::uint64_t seed) : options(given), random_(seed) {
    camera.width = 1280;
    camera.height = 960;
    camera.fx = camera.fy = 1000.0;
    camera.cx = 639.5;
    camera.cy = 479.5;
    const double about = random_.Uniform(0.0, 6.283185307179586);
    const Eigen::Vector3d axis(std::cos(about), std::sin(about), 0.0);
    pose.rotation =
        ExpRotation(options.tilt * axis) * Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
    pose.translation = Eigen::Vector3d(0.05, -0.1, 1.0) * options.depth;
    const double to = random_.Uniform(0.0, 6.283185307179586);
    Turn(options.speed, to);
  }

  // The next frame's pose.
  void Step() {
    const double dt = 1.0 / options.fps;
    const CameraPose before = pose;
    const Eigen::Vector3d w0 = turn_rate_, v0 = velocity_;
    for (int attempt = 0;; ++attempt) {
      const double w = options.turn_rate_sigma * std::sqrt(dt),
                   v = options.velocity_sigma * std::sqrt(dt) * before.translation.norm();
      turn_rate_ = w0 + w * Normal();
      velocity_ = v0 + v * Normal();
      // Between the velocities before and after: what a random walk does, up to its bridge.
      const Eigen::Vector3d turn = 0.5 * dt * (w0 + turn_rate_), half = 0.5 * turn;
      const Eigen::Matrix3d E = ExpRotation(turn);
      pose.rotation = E * before.rotation;
      pose.translation = E * before.translation + ExpRotation(half) * (0.5 * dt * (v0 + velocity_));
      if (IsInView()) break;
      constexpr int kPatience = 20;  // Then it turns round.
      if (attempt < kPatience) continue;
      pose = before;
      turn_rate_ = -0.5 * w0;
      velocity_ = -0.5 * v0;
      break;
    }
  }

  // A frame with new noise.
  Observations Observe(bool is_occluded) {
    Observations frame;
    frame.camera = camera;
    if (is_occluded) return frame;
    frame.circles.push_back(Circle("c0", 0.0, 0.0, 1.0));
    if (options.second_circle) frame.circles.push_back(Circle("c1", 2.0, 0.6, 0.6));
    if (options.pencil) {
      PencilObservation pencil;
      pencil.id = "x";
      pencil.plane = "p0";
      pencil.direction = PencilDirection::kX;
      pencil.sigma_px = options.noise_px;
      for (const double y : {-1.6, -1.3, 1.3, 1.6}) {
        LineObservation line;
        for (int i = 0; i < 30; ++i) line.points.push_back(Noisy(-1.5 + i * 3.0 / 29.0, y));
        pencil.lines.push_back(line);
      }
      frame.pencils.push_back(pencil);
    }
    return frame;
  }
  bool DrawOccluded() { return random_.Uniform() < options.occluded; }

  Eigen::Vector2d Pixel(const CameraPose& at, double x, double y) const {
    Eigen::Vector2d pixel(-1e9, -1e9);
    CameraToPixel(camera, at.rotation * Eigen::Vector3d(x, y, 0.0) + at.translation, &pixel);
    return pixel;
  }

  TrajectoryOptions options;
  Camera camera;
  CameraPose pose;

 private:
  Eigen::Vector3d Normal() {
    const double x = random_.Normal(), y = random_.Normal(), z = random_.Normal();
    return {x, y, z};
  }
  // About the plane's origin, which stays in the photo.
  void Turn(double speed, double to) {
    turn_rate_ = speed * Eigen::Vector3d(std::cos(to), std::sin(to), 0.2);
    velocity_ = -turn_rate_.cross(pose.translation);
  }
  bool IsInView() const {
    for (int i = 0; i < 16; ++i) {
      const double a = 6.283185307179586 * i / 16, reach = options.second_circle ? 2.8 : 1.7;
      const Eigen::Vector2d p = Pixel(pose, reach * std::cos(a), reach * std::sin(a));
      if (p.x() < 0.0 || p.y() < 0.0 || p.x() > camera.width || p.y() > camera.height) return false;
    }
    const double distance = pose.translation.norm();
    constexpr double kSteep = 0.25;  // Sine of the least angle between plane and line of sight.
    return -pose.rotation.col(2).dot(pose.translation) > kSteep * distance &&
           distance < 2.0 * options.depth;
  }
  Eigen::Vector2d Noisy(double x, double y) {
    const double dx = random_.Normal(), dy = random_.Normal();
    return Pixel(pose, x, y) + options.noise_px * Eigen::Vector2d(dx, dy);
  }
  CircleObservation Circle(const std::string& id, double x, double y, double radius) {
    CircleObservation circle;
    circle.id = id;
    circle.plane = "p0";
    circle.sigma_px = options.noise_px;
    constexpr int kPoints = 100;
    for (int i = 0; i < kPoints; ++i) {
      const double a = 6.283185307179586 * i / kPoints;
      circle.points.push_back(Noisy(x + radius * std::cos(a), y + radius * std::sin(a)));
    }
    return circle;
  }

  Random random_;
  Eigen::Vector3d turn_rate_, velocity_;  // Of the world in the camera frame.
};

}  // namespace circline

#endif  // CIRCLINE_TESTS_TRAJECTORY_H_
