#include "circline/refine/covariance.h"

#include <Eigen/Dense>
#include <cmath>

namespace circline {

bool ComputeCovariance(const JointEvidence& evidence, const JointState& state,
                       SharedCovariance* out, double gate_stretch) {
  const SharedColumns columns(evidence);
  ReducedModel model;
  if (!Linearize(evidence, state, columns, Weighing{gate_stretch, true}, &model)) return false;
  Eigen::MatrixXd& information = model.hessian;
  constexpr int kSpin = 2;
  if (!evidence.x_is_fixed) {
    information.row(kSpin).setZero();
    information.col(kSpin).setZero();
  }
  // Scaled to a unit diagonal, so that the threshold for "no information" is free of units.
  const Eigen::VectorXd scale =
      information.diagonal().unaryExpr([](double d) { return d > 0.0 ? 1.0 / std::sqrt(d) : 1.0; });
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scale.asDiagonal() * information *
                                                             scale.asDiagonal());
  if (eigen.info() != Eigen::Success || !eigen.eigenvalues().allFinite()) return false;
  constexpr double kNoInformation = 1e-12;
  const Eigen::MatrixXd vectors = scale.asDiagonal() * eigen.eigenvectors();
  double log_det_information = -2.0 * scale.array().log().sum();
  Eigen::Index nulls = 0;
  while (nulls < columns.size && eigen.eigenvalues()[nulls] <= kNoInformation) ++nulls;
  const auto known = eigen.eigenvalues().tail(columns.size - nulls);
  const auto known_vectors = vectors.rightCols(columns.size - nulls);
  out->covariance.noalias() =
      known_vectors * known.cwiseInverse().asDiagonal() * known_vectors.transpose();
  log_det_information += known.array().log().sum();
  out->null_space = vectors.leftCols(nulls).colwise().normalized();
  out->offsets = columns.offsets;
  out->log_det = -log_det_information;
  out->circle_log_det = model.circle_log_det;
  out->line_log_det = model.line_log_det;
  for (double& v : out->circle_log_det) v = -v;
  for (double& v : out->line_log_det) v = -v;
  return std::isfinite(out->log_det);
}

}  // namespace circline
