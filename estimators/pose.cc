#include "circline/estimators/pose.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "circline/estimators/directions.h"

namespace circline {

Camera CameraOf(const PoseHypothesis& hypothesis, const Camera& given) {
  Camera camera = hypothesis.camera.value_or(given);
  if (hypothesis.camera) return camera;
  camera.fx *= hypothesis.focal_scale;
  camera.fy *= hypothesis.focal_scale;
  return camera;
}

Eigen::Matrix3d CrossMatrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

Eigen::Matrix3d ExpRotation(const Eigen::Vector3d& delta) {
  const double angle = delta.norm();
  const double half = 0.5 * angle;
  const double sinc = angle > 1e-4 ? std::sin(half) / angle : 0.5 - angle * angle / 48.0;
  return Eigen::Quaterniond(std::cos(half), sinc * delta.x(), sinc * delta.y(), sinc * delta.z())
      .normalized()
      .toRotationMatrix();
}

Eigen::Vector3d LogRotation(const Eigen::Matrix3d& rotation) {
  Eigen::Quaterniond q(rotation);
  if (q.w() < 0.0) q.coeffs() = -q.coeffs();
  const double sine = q.vec().norm();
  const double factor = sine > 1e-9 ? 2.0 * std::atan2(sine, q.w()) / sine : 2.0;
  return factor * q.vec();
}

double RotationAngle(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return LogRotation(a * b.transpose()).norm();
}

bool PoseHypothesis::RotationIsFree() const {
  return std::any_of(
      free_directions.begin(), free_directions.end(),
      [](const std::array<double, 6>& d) { return std::hypot(d[0], d[1], d[2]) > 1e-6; });
}

Eigen::Vector3d PoseHypothesis::SigmaRotation() const {
  Eigen::Vector3d sigma = Covariance().diagonal().head<3>().cwiseMax(0.0).cwiseSqrt();
  for (const std::array<double, 6>& d : free_directions) {
    for (int i = 0; i < 3; ++i) {
      if (std::abs(d[static_cast<std::size_t>(i)]) > 1e-6)
        sigma[i] = std::numeric_limits<double>::infinity();
    }
  }
  return sigma;
}

double PoseHypothesis::SigmaNormal() const {
  constexpr double kTiny = 1e-6;
  const Eigen::Vector3d normal = cam_from_world.rotation.col(2);
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - normal * normal.transpose();
  for (const std::array<double, 6>& d : free_directions) {
    if ((across * Eigen::Vector3d(d[0], d[1], d[2])).norm() > kTiny)
      return std::numeric_limits<double>::infinity();
  }
  const Eigen::Matrix3d covariance = across * Covariance().topLeftCorner<3, 3>() * across;
  if (!covariance.allFinite()) return std::numeric_limits<double>::quiet_NaN();
  return LargestSigma(covariance);
}

void SetCovariance(Matrix6d covariance, PoseHypothesis* hypothesis, int num_variables) {
  constexpr double kRounding = 1e-12;
  const double nothing = kRounding * covariance.cwiseAbs().maxCoeff();
  // Where next to nothing is known of a direction, rounding may leave less than that.
  if (covariance.allFinite() && covariance.diagonal().minCoeff() < -nothing) {
    const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(covariance);
    covariance = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).asDiagonal() *
                 eigen.eigenvectors().transpose();
  }
  Vector6d scale = Vector6d::Zero();
  for (int i = 0; i < 6; ++i) {
    if (covariance(i, i) > 0.0) {
      scale[i] = 1.0 / std::sqrt(covariance(i, i));
    } else if (covariance(i, i) >= -nothing) {
      covariance.row(i).setZero();
      covariance.col(i).setZero();
    }
  }
  const Matrix6d correlation = scale.asDiagonal() * covariance * scale.asDiagonal();
  const auto rank =
      static_cast<int>(Eigen::FullPivLU<Matrix6d>(correlation).setThreshold(1e-9).rank());
  const int most = num_variables - static_cast<int>(hypothesis->free_directions.size());
  hypothesis->rank = std::min(rank, std::max(0, most));
  Eigen::Map<Matrix6d>(hypothesis->covariance.data()) = covariance;
}

void RankHypotheses(std::vector<PoseHypothesis>* hypotheses) {
  if (hypotheses->empty()) return;
  const auto log_posterior = [](const PoseHypothesis& h) { return -h.cost + 0.5 * h.log_det; };
  double best = log_posterior(hypotheses->front());
  for (const PoseHypothesis& h : *hypotheses) best = std::max(best, log_posterior(h));
  // Less than this tells no pose from another: the order stays, lest noise turn it from photo to
  // photo.
  constexpr double kTie = 0.1;
  std::stable_sort(hypotheses->begin(), hypotheses->end(),
                   [&](const PoseHypothesis& a, const PoseHypothesis& b) {
                     const double pa = log_posterior(a), pb = log_posterior(b);
                     const bool ta = pa > best - kTie, tb = pb > best - kTie;
                     return ta != tb ? ta : !ta && pa > pb;
                   });
  double sum = 0.0;
  for (PoseHypothesis& h : *hypotheses) {
    h.probability = std::exp(log_posterior(h) - best);
    sum += h.probability;
  }
  for (PoseHypothesis& h : *hypotheses) h.probability /= sum;
}

}  // namespace circline
