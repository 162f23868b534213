// Options for simulated evidence, which has the noise of points and nothing else, and what its
// estimates are asked.
#ifndef CIRCLINE_TESTS_REFINE_SIMULATED_OPTIONS_H_
#define CIRCLINE_TESTS_REFINE_SIMULATED_OPTIONS_H_

#include <Eigen/Dense>
#include <cmath>

#include "circline/estimators/noise_model.h"
#include "circline/refine/estimate_pose.h"
#include "tests/basics.h"

namespace circline {

inline EstimationOptions Exact(LossType loss = LossOptions().type) {
  EstimationOptions options;
  options.noise_model = NoiseModel::Exact();
  options.conic_loss.type = options.line_loss.type = loss;
  return options;
}

// Gaussian noise without outliers: the bound holds for this.
inline EstimationOptions LeastSquares(const NoiseModel& model = NoiseModel::Exact()) {
  EstimationOptions options = Exact(LossType::kTrivial);
  options.noise_model = model;
  return options;
}

// The best hypothesis of an estimate that must have one.
inline PoseHypothesis Best(const PoseEstimate& estimate) { return Ok(estimate).hypotheses.front(); }

// Of a hypothesis' normal, two components.
struct NormalErrors {
  Eigen::Vector2d error;
  Eigen::Matrix2d covariance;

  NormalErrors(const PoseHypothesis& h, const CameraPose& truth) {
    const Eigen::Matrix3d& R = h.cam_from_world.rotation;
    const Eigen::Matrix<double, 3, 2> tangents = R.leftCols<2>();
    error = tangents.transpose() * R.col(2).cross(truth.rotation.col(2));
    covariance = tangents.transpose() * h.Covariance().topLeftCorner<3, 3>() * tangents;
  }
  double Nees() const { return error.dot(covariance.inverse() * error); }
  double Sigma() const { return std::sqrt(covariance.trace()); }
};

// Root of the sum of both variances, radians.
inline double SigmaNormal(const PoseHypothesis& h) { return NormalErrors(h, {}).Sigma(); }

// Of a hypothesis' rotation, 3 expected; where its spin about the normal is free, of the normal, 2
// expected.
inline double RotationNees(const PoseHypothesis& h, const CameraPose& truth) {
  if (h.RotationIsFree()) return NormalErrors(h, truth).Nees();
  const Eigen::Vector3d error = LogRotation(truth.rotation * h.cam_from_world.rotation.transpose());
  return error.dot(h.Covariance().topLeftCorner<3, 3>().inverse() * error);
}

}  // namespace circline

#endif  // CIRCLINE_TESTS_REFINE_SIMULATED_OPTIONS_H_
