#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "apps/benchmark/tracking_bound.h"
#include "circline/estimators/circle_pose.h"
#include "circline/refine/image_points.h"

namespace circline::apps {
namespace {

constexpr double kStep = 1e-5;  // Of differences.

}  // namespace

TrackingBound::TrackingBound(const Trajectory& sequence, const TrackerOptions& options)
    : sequence_(sequence), options_(options) {
  map_.Reset(true, sequence.camera, CameraSigma::Exact(), true);
  const Trajectory::Frame& first = sequence.frames.front();
  const double distance = first.pose.translation.norm();
  const double velocity = options.initial_velocity_sigma * distance;
  // As a tracker begins: nothing is known but the convention for the turn about the normal.
  const bool turn_is_free = !sequence.options().pencil;
  const Eigen::Vector3d rotation(1.0, 1.0, turn_is_free ? 1e-4 : 1.0),
      translation = Eigen::Vector3d::Constant(distance);
  const Eigen::Vector3d rates = Eigen::Vector3d::Constant(options.initial_turn_rate_sigma),
                        velocities = Eigen::Vector3d::Constant(velocity);
  const Eigen::VectorXd zeros = Eigen::VectorXd::Zero(kCameraSize);
  const Eigen::Quaterniond q(first.pose.rotation);
  const auto add = [&](int block, const double* values, const Eigen::VectorXd& sigma) {
    state_.Append(map_, block, values, Eigen::MatrixXd(sigma.cwiseAbs2().asDiagonal()));
  };
  add(TrackMap::kRotation, q.coeffs().data(), rotation);
  add(TrackMap::kTranslation, first.pose.translation.data(), translation);
  add(TrackMap::kTurnRate, first.turn_rate.data(), rates);
  add(TrackMap::kVelocity, first.velocity.data(), velocities);
  add(TrackMap::kCamera, zeros.data(), Eigen::VectorXd());
  const std::vector<Trajectory::Circle> circles = sequence.Circles();
  for (std::size_t i = 1; i < circles.size(); ++i) {  // The first one is the unit.
    const double place[] = {circles[i].x, circles[i].y, circles[i].radius};
    add(map_.AddBlock(3), place, translation);
  }
}

void TrackingBound::SetTruth(const Trajectory::Frame& frame) {
  state_.SetPose(map_, frame.pose);
  const auto set = [&](int block, const Eigen::Vector3d& v) {
    state_.x.segment<3>(map_.block(block).offset) = v;
  };
  set(TrackMap::kTurnRate, frame.turn_rate);
  set(TrackMap::kVelocity, frame.velocity);
}

// Of pose and circles; the lines' own places are eliminated.
Eigen::MatrixXd TrackingBound::Information(const Trajectory::Frame& frame) const {
  const Observations exact = sequence_.Observe(frame, nullptr);
  const std::vector<Trajectory::Circle> circles = sequence_.Circles();
  const std::vector<double> heights = Trajectory::LineHeights();
  const auto num_circles = static_cast<Eigen::Index>(circles.size()),
             num_lines = static_cast<Eigen::Index>(exact.pencils.empty() ? 0 : heights.size());
  const Eigen::Index known = 6 + 3 * (num_circles - 1), unknowns = known + num_lines;
  ImagePoints::Options point_options;
  point_options.sigma_px = sequence_.options().noise_px;
  std::vector<ImagePoints> contours, lines;
  for (const CircleObservation& c : exact.circles)
    contours.emplace_back(exact.camera, c.points, std::vector<std::uint8_t>(), point_options);
  for (Eigen::Index j = 0; j < num_lines; ++j) {
    lines.emplace_back(exact.camera, exact.pencils[0].lines[static_cast<std::size_t>(j)].points,
                       std::vector<std::uint8_t>(), point_options);
  }
  // All distances, pixels, where the unknowns are this far from the truth.
  const auto distances = [&](const Eigen::VectorXd& d) {
    CameraPose pose = frame.pose;
    pose.rotation = pose.rotation * ExpRotation(d.head<3>());
    pose.translation += d.segment<3>(3);
    std::vector<double> all, some;
    for (std::size_t i = 0; i < circles.size(); ++i) {
      Eigen::Vector3d c(circles[i].x, circles[i].y, circles[i].radius);
      if (i > 0) c += d.segment<3>(6 + 3 * (static_cast<Eigen::Index>(i) - 1));
      CirclePose circle;
      circle.center =
          (pose.rotation * Eigen::Vector3d(c.x(), c.y(), 0.0) + pose.translation) / c.z();
      circle.normal = pose.rotation.col(2);
      contours[i].ConicDistances(ProjectCircle(circle), 0.0, nullptr, &some);
      all.insert(all.end(), some.begin(), some.end());
    }
    for (Eigen::Index j = 0; j < num_lines; ++j) {
      const double y = heights[static_cast<std::size_t>(j)] + d[known + j];
      const Eigen::Vector3d a = pose.rotation * Eigen::Vector3d(-1.0, y, 0.0) + pose.translation,
                            b = pose.rotation * Eigen::Vector3d(1.0, y, 0.0) + pose.translation;
      const Eigen::Vector3d line = a.cross(b).normalized();
      lines[static_cast<std::size_t>(j)].LineDistances(line, nullptr, &some);
      all.insert(all.end(), some.begin(), some.end());
    }
    return Eigen::VectorXd(
        Eigen::Map<const Eigen::VectorXd>(all.data(), static_cast<Eigen::Index>(all.size())));
  };
  Eigen::MatrixXd J;
  for (Eigen::Index k = 0; k < unknowns; ++k) {
    Eigen::VectorXd d = Eigen::VectorXd::Zero(unknowns);
    d[k] = kStep;
    const Eigen::VectorXd forward = distances(d), backward = distances(-d);
    J.conservativeResize(forward.size(), unknowns);
    J.col(k) = (forward - backward) / (2.0 * kStep * point_options.sigma_px);
  }
  const Eigen::MatrixXd H = J.transpose() * J;
  if (num_lines == 0) return H;
  return H.topLeftCorner(known, known) -
         H.topRightCorner(known, num_lines) * H.bottomRightCorner(num_lines, num_lines)
                                                  .llt()
                                                  .solve(H.bottomLeftCorner(num_lines, known));
}

double TrackingBound::Advance(std::size_t k) {
  Eigen::MatrixXd& P = state_.covariance;
  if (k > 0) {
    SetTruth(sequence_.frames[k - 1]);
    MoveOn(map_, options_, 1.0 / sequence_.options().fps, &state_);
  }
  SetTruth(sequence_.frames[k]);
  if (!sequence_.frames[k].is_occluded) {
    const Eigen::MatrixXd H = Information(sequence_.frames[k]);
    // Its unknowns within the state: the velocities have no part in it.
    std::vector<Eigen::Index> rows;
    for (Eigen::Index r = 0; r < P.rows(); ++r) {
      if (r < 6 || r >= 12) rows.push_back(r);
    }
    Eigen::MatrixXd information = P.inverse();
    information(rows, rows) += H;
    P = information.inverse();
    P = 0.5 * (P + P.transpose()).eval();
  }
  return std::sqrt(P.topLeftCorner<2, 2>().trace());
}

}  // namespace circline::apps
