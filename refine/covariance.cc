#include "circline/refine/covariance.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

namespace circline {
namespace {

// Log determinant of the covariance without what known lengths have of their own: their ends, and
// the scale where no circle has a part in it. A hypothesis that leaves a length out has none of it.
double LogDetWithoutLengths(const JointEvidence& e, const SharedCovariance& shared) {
  std::vector<int> of_lengths;
  for (const LengthTerm& t : e.lengths) of_lengths.insert(of_lengths.end(), {t.a, t.b});
  if (std::none_of(e.circles.begin(), e.circles.end(),
                   [&](const CircleTerm& t) { return t.radius == e.scale; })) {
    of_lengths.push_back(e.scale);
  }
  std::vector<int> kept;
  for (std::size_t i = 0; i < e.parameters.size(); ++i) {
    const bool is_other =
        std::count(of_lengths.begin(), of_lengths.end(), static_cast<int>(i)) == 0;
    for (int k = 0; k < e.parameters[i].size && shared.offsets[i] >= 0 && is_other; ++k) {
      const int column = shared.offsets[i] + k;
      if (shared.covariance(column, column) > 0.0) kept.push_back(column);
    }
  }
  const Eigen::MatrixXd covariance = shared.covariance(kept, kept);
  const Eigen::VectorXd scale = covariance.diagonal().cwiseSqrt().cwiseInverse();
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(scale.asDiagonal() * covariance * scale.asDiagonal());
  constexpr double kNoInformation = 1e-12;
  double log_det = -2.0 * scale.array().log().sum();
  for (const double d : ldlt.vectorD()) {
    if (d > kNoInformation) log_det += std::log(d);
  }
  return log_det;
}

}  // namespace

bool ComputeCovariance(const JointEvidence& evidence, const JointState& state,
                       SharedCovariance* out, double gate_stretch) {
  const SharedColumns columns(evidence);
  ReducedModel model;
  if (!Linearize(evidence, state, columns, SetWeighing{gate_stretch, true}, &model)) return false;
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
  out->log_det =
      evidence.lengths.empty() ? -log_det_information : LogDetWithoutLengths(evidence, *out);
  out->circle_log_det = model.circle_log_det;
  out->line_log_det = model.line_log_det;
  for (double& v : out->circle_log_det) v = -v;
  for (double& v : out->line_log_det) v = -v;
  return std::isfinite(out->log_det);
}

}  // namespace circline
