// Sequences for trackers: a camera that moves over a plane with circles and lines. For the
// benchmark and the tests.
#ifndef CIRCLINE_APPS_BENCHMARK_TRAJECTORY_H_
#define CIRCLINE_APPS_BENCHMARK_TRAJECTORY_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/random.h"
#include "circline/refine/pose_tracker.h"
#include "tests/basics.h"
#include "tests/pinhole_camera.h"

namespace circline {

struct TrajectoryOptions {
  int num_frames = 100;
  double fps = 30.0;
  double noise_px = 2.0;
  double occluded = 0.2;  // Share of the frames, but the first, in which nothing is seen.
  // Random walks of the velocities, as TrackerOptions has them: within a second, radians and
  // distances of the origin a second.
  double turn_rate_sigma = 0.2, velocity_sigma = 0.1;
  // Of the first velocities, as TrackerOptions has them.
  double initial_turn_rate_sigma = 0.2, initial_velocity_sigma = 0.15;
  double speed = 0.0;   // And a turn about the plane's origin at first, radians a second.
  double tilt = 0.6;    // Of the plane at first, radians.
  double depth = 10.0;  // Of the plane's origin at first; the radius of the first circle is 1.
  bool second_circle = false, pencil = false;
};

// Poses by a random walk of the twist, drawn anew until the circles stay in the photo.
class Trajectory {
 public:
  struct Frame {
    CameraPose pose;
    Eigen::Vector3d turn_rate, velocity;  // Of the world in the camera frame.
    bool is_occluded = false;
  };

  Trajectory(const TrajectoryOptions& options, std::uint64_t seed)
      : options_(options), random_(seed) {
    while (!Draw()) continue;
  }

  // `noise`: null for none.
  Observations Observe(const Frame& frame, Random* noise) const {
    Observations seen;
    seen.camera = camera;
    if (frame.is_occluded) return seen;
    const auto pixel = [&](double x, double y) {
      Eigen::Vector2d p = Pixel(frame.pose, x, y);
      if (noise == nullptr) return p;
      return Eigen::Vector2d(p + Noise2(options_.noise_px, noise));
    };
    for (const Circle& c : Circles()) {
      CircleObservation circle;
      circle.id = c.id;
      circle.plane = "p0";
      circle.sigma_px = options_.noise_px;
      for (int i = 0; i < kContour; ++i) {
        const double a = kTurn * i / kContour;
        circle.points.push_back(pixel(c.x + c.radius * std::cos(a), c.y + c.radius * std::sin(a)));
      }
      seen.circles.push_back(circle);
    }
    if (!options_.pencil) return seen;
    PencilObservation pencil;
    pencil.id = "x";
    pencil.plane = "p0";
    pencil.direction = PencilDirection::kX;
    pencil.sigma_px = options_.noise_px;
    for (const double y : LineHeights()) {
      LineObservation line;
      for (int i = 0; i < kLinePoints; ++i) line.points.push_back(pixel(AlongLine(i), y));
      pencil.lines.push_back(line);
    }
    seen.pencils.push_back(pencil);
    return seen;
  }

  struct Circle {
    std::string id;
    double x, y, radius;
  };
  std::vector<Circle> Circles() const {
    std::vector<Circle> circles = {{"c0", 0.0, 0.0, 1.0}};
    if (options_.second_circle) circles.push_back({"c1", 2.0, 0.6, 0.6});
    return circles;
  }
  static std::vector<double> LineHeights() { return {-1.6, -1.3, 1.3, 1.6}; }
  static double AlongLine(int i) { return -1.5 + 3.0 * i / (kLinePoints - 1); }
  static constexpr int kContour = 100, kLinePoints = 30;

  Eigen::Vector2d Pixel(const CameraPose& pose, double x, double y) const {
    Eigen::Vector2d pixel(-1e9, -1e9);
    CameraToPixel(camera, pose.rotation * Eigen::Vector3d(x, y, 0.0) + pose.translation, &pixel);
    return pixel;
  }
  const TrajectoryOptions& options() const { return options_; }

  Camera camera = CenteredCamera(1000.0, 1280, 960);
  std::vector<Frame> frames;

 private:
  static constexpr double kTurn = 2.0 * kPi;

  Frame First() {
    Frame first;
    const double about = random_.Uniform(0.0, kTurn), to = random_.Uniform(0.0, kTurn);
    first.pose.rotation =
        ExpRotation(options_.tilt * Eigen::Vector3d(std::cos(about), std::sin(about), 0.0)) *
        Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal();
    first.pose.translation = options_.depth * Eigen::Vector3d(0.05, -0.05, 1.0);
    const Eigen::Vector3d about_origin =
        options_.speed * Eigen::Vector3d(std::cos(to), std::sin(to), 0.0);
    first.turn_rate = about_origin + options_.initial_turn_rate_sigma * Noise3(1.0, &random_);
    first.velocity = options_.initial_velocity_sigma * options_.depth * Noise3(1.0, &random_) -
                     about_origin.cross(first.pose.translation);
    return first;
  }

  bool Draw() {
    frames = {First()};
    while (static_cast<int>(frames.size()) < options_.num_frames) {
      frames.push_back(After(frames.back()));
      if (!IsInView(frames.back().pose)) return false;
    }
    return true;
  }

  // The velocities change in small steps within a frame.
  Frame After(Frame frame) {
    constexpr int kSteps = 4;
    const double dt = 1.0 / (options_.fps * kSteps);
    for (int i = 0; i < kSteps; ++i) {
      frame.turn_rate += options_.turn_rate_sigma * std::sqrt(dt) * Noise3(1.0, &random_);
      frame.velocity += options_.velocity_sigma * std::sqrt(dt) * frame.pose.translation.norm() *
                        Noise3(1.0, &random_);
      const Eigen::Vector3d turn = dt * frame.turn_rate;
      frame.pose.rotation = ExpRotation(turn) * frame.pose.rotation;
      frame.pose.translation = ExpRotation(turn) * frame.pose.translation +
                               ExpRotation(0.5 * turn) * (dt * frame.velocity);
    }
    frame.is_occluded = random_.Uniform() < options_.occluded;
    return frame;
  }

  bool IsInView(const CameraPose& pose) const {
    constexpr double kReach = 2.7, kReachAlone = 1.7;  // Of the circles from the origin.
    const double reach = options_.second_circle ? kReach : kReachAlone;
    for (int i = 0; i < 16; ++i) {
      const Eigen::Vector2d p =
          Pixel(pose, reach * std::cos(kTurn * i / 16), reach * std::sin(kTurn * i / 16));
      const bool is_inside =
          p.x() > 0.0 && p.y() > 0.0 && p.x() < camera.width && p.y() < camera.height;
      if (!is_inside) return false;
    }
    constexpr double kSteep = 0.3;  // Sine of the least angle between plane and line of sight.
    return -pose.rotation.col(2).dot(pose.translation) > kSteep * pose.translation.norm();
  }

  TrajectoryOptions options_;
  Random random_;
};

// --- What trackers of such sequences are asked, and how far off they are. ---

inline TrackerOptions ExactOptions(const TrajectoryOptions& trajectory) {
  TrackerOptions options;
  options.estimation.noise_model = NoiseModel::Exact();
  options.estimation.conic_loss.type = options.estimation.line_loss.type = LossType::kTrivial;
  options.turn_rate_sigma = trajectory.turn_rate_sigma;
  options.velocity_sigma = trajectory.velocity_sigma;
  options.initial_turn_rate_sigma = trajectory.initial_turn_rate_sigma;
  options.initial_velocity_sigma = trajectory.initial_velocity_sigma;
  return options;
}

inline double NormalError(const CameraPose& truth, const PoseHypothesis& h) {
  return std::acos(
      std::clamp(truth.rotation.col(2).dot(h.cam_from_world.rotation.col(2)), -1.0, 1.0));
}

inline double RotationError(const CameraPose& truth, const PoseHypothesis& h) {
  return LogRotation(truth.rotation * h.cam_from_world.rotation.transpose()).norm();
}

// The turn between two frames, as a gyroscope without error has it, that says how well it knows it.
constexpr double kGyroscopeSigma = 0.001;  // Radians of each component.
inline MotionPrior Gyroscope(const CameraPose& before, const CameraPose& now) {
  MotionPrior motion;
  motion.relative.emplace();
  motion.relative->now_from_before.rotation = now.rotation * before.rotation.transpose();
  motion.relative->has_translation = false;
  for (std::size_t k = 0; k < 6; ++k)
    motion.relative->covariance[7 * k] = kGyroscopeSigma * kGyroscopeSigma;
  return motion;
}

}  // namespace circline

#endif  // CIRCLINE_APPS_BENCHMARK_TRAJECTORY_H_
