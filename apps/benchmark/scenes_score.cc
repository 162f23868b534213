#include "apps/benchmark/scenes_score.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "apps/common/text.h"
#include "circline/estimators/basics.h"
#include "circline/estimators/line_pose.h"

namespace circline::apps {
namespace {

constexpr double kSure = 0.99;

struct PoseError {
  // Radians: 3 components of the rotation, 2 of the normal; then that of log f, if not known.
  Eigen::VectorXd error;
  Eigen::VectorXd sigma;   // Their standard deviations, as stated.
  double nees = 0.0;       // A component; not finite where the covariance is singular.
  double angle = 0.0;      // Radians.
  double log_focal = 0.0;  // 0 where it is known.
};

// Directions have no sense: up to half turns about the axes of the world.
PoseError ErrorOf(const Scene& scene, const PoseHypothesis& hypothesis) {
  const Eigen::Matrix3d& truth = scene.world.pose.rotation;
  const Eigen::Matrix3d& estimate = hypothesis.cam_from_world.rotation;
  Eigen::MatrixXd components = Eigen::Matrix3d::Identity();
  Eigen::Vector3d delta = Eigen::Vector3d::Constant(10.0);
  if (scene.bound.rotation_is_free || hypothesis.RotationIsFree()) {
    const Eigen::Vector3d from = estimate.col(2), to = truth.col(2);
    delta = LogRotation(
        Eigen::Quaterniond::FromTwoVectors(from, from.dot(to) < 0.0 ? Eigen::Vector3d(-to) : to)
            .toRotationMatrix());
    components.resize(2, 3);
    components << from.unitOrthogonal().transpose(), from.cross(from.unitOrthogonal()).transpose();
  } else {
    for (const Eigen::Matrix3d& R : SignChoices(truth)) {
      const Eigen::Vector3d candidate = LogRotation(R * estimate.transpose());
      if (candidate.norm() < delta.norm()) delta = candidate;
    }
  }
  PoseError result;
  result.error = components * delta;
  result.angle = result.error.norm();
  Eigen::MatrixXd covariance =
      components * hypothesis.Covariance().topLeftCorner<3, 3>() * components.transpose();
  if (scene.request.log_focal_sigma > 0.0) {
    const double scale = hypothesis.focal_scale;
    // As delta: truth less estimate.
    result.log_focal = std::log(scene.world.camera.fx / hypothesis.camera.value_or(Camera()).fx);
    const auto n = result.error.size();
    const Eigen::VectorXd shared =
        components * Eigen::Map<const Eigen::Vector3d>(hypothesis.focal_covariance.data()) / scale;
    covariance.conservativeResize(n + 1, n + 1);
    covariance.col(n).head(n) = shared;
    covariance.row(n).head(n) = shared.transpose();
    covariance(n, n) = std::pow(hypothesis.focal_sigma / scale, 2);
    result.error.conservativeResize(n + 1);
    result.error[n] = result.log_focal;
  }
  result.sigma = covariance.diagonal().cwiseMax(0.0).cwiseSqrt();
  result.nees = result.error.dot(covariance.inverse() * result.error) /
                static_cast<double>(result.error.size());
  return result;
}

bool IsWrong(const PoseError& error, const Bound& bound) {
  constexpr double kSigmas = 5.0, kLeast = 2.0 * kDegree, kLeastLogFocal = 0.1;
  return error.angle > std::max(kLeast, kSigmas * bound.rotation_rad) ||
         std::abs(error.log_focal) > std::max(kLeastLogFocal, kSigmas * bound.log_focal);
}

std::string Percent(int part, int whole) {
  return FormatFixed(100.0 * part / std::max(1, whole), 1);
}

}  // namespace

void Tally::Add(const Scene& scene, const PoseEstimate& estimate) {
  ++trials_;
  if (!estimate.status.ok()) {
    ++refused_;
    return;
  }
  std::vector<PoseError> errors;
  for (const PoseHypothesis& h : estimate.hypotheses) errors.push_back(ErrorOf(scene, h));
  const PoseError& nearest =
      *std::min_element(errors.begin(), errors.end(),
                        [](const PoseError& a, const PoseError& b) { return a.angle < b.angle; });
  if (IsWrong(nearest, scene.bound)) {
    ++missing_;
  } else {
    ++right_;
    squared_error_ += std::pow(nearest.angle / scene.bound.rotation_rad, 2);
    if (scene.bound.log_focal > 0.0) {
      squared_focal_error_ += std::pow(nearest.log_focal / scene.bound.log_focal, 2);
    }
    if (std::isfinite(nearest.nees)) nees_ += nearest.nees;
    components_ += static_cast<int>(nearest.error.size());
    covered_ +=
        static_cast<int>((nearest.error.array().abs() <= 2.0 * nearest.sigma.array()).count());
  }

  const PoseHypothesis& first = estimate.hypotheses.front();
  const bool is_wrong = IsWrong(errors.front(), scene.bound), is_sure = first.probability >= kSure;
  wrong_ += is_wrong ? 1 : 0;
  sure_ += is_sure ? 1 : 0;
  sure_wrong_ += is_sure && is_wrong ? 1 : 0;
  expected_wrong_ += 1.0 - first.probability;
  const auto odd = std::count_if(scene.odd.begin(), scene.odd.end(), [&](const std::string& id) {
    return std::count(first.left_out.begin(), first.left_out.end(), id) > 0;
  });
  odd_left_out_ += odd == static_cast<std::ptrdiff_t>(scene.odd.size()) ? 1 : 0;
  others_left_out_ += odd < static_cast<std::ptrdiff_t>(first.left_out.size()) ? 1 : 0;
}

std::string Tally::Header() {
  return "    n refused%  missing% rms/bound  of f NEES/dim  cover%   wrong% expected%  "
         "sure wrong  left out: odd% others%";
}

std::string Tally::Row() const {
  const int answered = trials_ - refused_;
  char line[160];
  std::snprintf(
      line, sizeof(line), "%5d %8s  %8s %9s %5s %8s  %6s   %6s %9s %5d %5d  %14s %7s", trials_,
      Percent(refused_, trials_).c_str(), Percent(missing_, answered).c_str(),
      FormatFixed(std::sqrt(squared_error_ / right_), 2).c_str(),
      squared_focal_error_ > 0.0 ? FormatFixed(std::sqrt(squared_focal_error_ / right_), 2).c_str()
                                 : "-",
      FormatFixed(nees_ / right_, 2).c_str(), Percent(covered_, components_).c_str(),
      Percent(wrong_, answered).c_str(), FormatFixed(100.0 * expected_wrong_ / answered, 1).c_str(),
      sure_, sure_wrong_, Percent(odd_left_out_, answered).c_str(),
      Percent(others_left_out_, answered).c_str());
  return line;
}

}  // namespace circline::apps
