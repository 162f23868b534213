#include "circline/refine/covariance.h"

#include <Eigen/Dense>
#include <cmath>

namespace circline {
namespace {

using RowMajorMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// J^T J of one residual block, shared parameters first; `columns` receives the shared columns'
// places in the whole problem.
struct BlockInformation {
  std::vector<int> columns;
  Eigen::MatrixXd shared, cross, own;  // Blocks of J^T J: shared, shared x private, private.
};

bool Linearize(const ResidualTerm& term, const std::vector<ParameterInfo>& parameters,
               const Values& values, const std::vector<int>& offsets, bool hold_spin,
               BlockInformation* out) {
  const int rows = term.cost->num_residuals();
  std::vector<const double*> pointers;
  std::vector<RowMajorMatrix> jacobians;
  std::vector<double*> jacobian_pointers;
  for (int block : term.blocks) {
    pointers.push_back(values[static_cast<std::size_t>(block)].data());
    jacobians.emplace_back(rows, parameters[static_cast<std::size_t>(block)].size);
  }
  for (RowMajorMatrix& jacobian : jacobians) jacobian_pointers.push_back(jacobian.data());
  Eigen::VectorXd residuals(rows);
  if (!term.cost->Evaluate(pointers.data(), residuals.data(), jacobian_pointers.data()))
    return false;

  Eigen::MatrixXd shared(rows, 0), own(rows, 0);
  const auto append = [](Eigen::MatrixXd* all, const Eigen::MatrixXd& more) {
    all->conservativeResize(Eigen::NoChange, all->cols() + more.cols());
    all->rightCols(more.cols()) = more;
  };
  for (std::size_t k = 0; k < term.blocks.size(); ++k) {
    const std::size_t block = static_cast<std::size_t>(term.blocks[k]);
    if (parameters[block].is_private) {
      append(&own, jacobians[k]);
      continue;
    }
    const Eigen::Index size = block == 0 && hold_spin ? 2 : parameters[block].size;
    append(&shared, jacobians[k].leftCols(size));
    for (int c = 0; c < size; ++c) out->columns.push_back(offsets[block] + c);
  }
  out->shared = shared.transpose() * shared;
  out->cross = shared.transpose() * own;
  out->own = own.transpose() * own;
  return out->shared.allFinite() && out->cross.allFinite() && out->own.allFinite();
}

}  // namespace

bool ComputeCovariance(const std::vector<ResidualTerm>& terms,
                       const std::vector<ParameterInfo>& parameters, const Values& values,
                       bool hold_spin, SharedCovariance* out) {
  int size = 0;
  out->offsets.assign(parameters.size(), -1);
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    if (parameters[i].is_private) continue;
    out->offsets[i] = size;
    size += i == 0 && hold_spin ? 2 : parameters[i].size;
  }
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(size, size);
  double log_det_information = 0.0;
  for (const ResidualTerm& term : terms) {
    BlockInformation block;
    if (!Linearize(term, parameters, values, out->offsets, hold_spin, &block)) return false;
    if (block.own.rows() > 0) {
      const Eigen::LLT<Eigen::MatrixXd> factor(block.own);
      if (factor.info() != Eigen::Success) return false;
      block.shared -= block.cross * factor.solve(block.cross.transpose());
      log_det_information += 2.0 * factor.matrixLLT().diagonal().array().log().sum();
    }
    for (std::size_t i = 0; i < block.columns.size(); ++i) {
      for (std::size_t j = 0; j < block.columns.size(); ++j) {
        information(block.columns[i], block.columns[j]) +=
            block.shared(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      }
    }
  }
  // Scaled to a unit diagonal, so that the threshold for "no information" is free of units.
  const Eigen::VectorXd scale =
      information.diagonal().unaryExpr([](double d) { return d > 0.0 ? 1.0 / std::sqrt(d) : 1.0; });
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scale.asDiagonal() * information *
                                                             scale.asDiagonal());
  if (eigen.info() != Eigen::Success || !eigen.eigenvalues().allFinite()) return false;
  constexpr double kNoInformation = 1e-12;
  const Eigen::MatrixXd vectors = scale.asDiagonal() * eigen.eigenvectors();
  Eigen::MatrixXd null(size, 0);
  out->covariance = Eigen::MatrixXd::Zero(size, size);
  for (int k = 0; k < size; ++k) {
    const double value = eigen.eigenvalues()[k];
    if (value > kNoInformation) {
      out->covariance += vectors.col(k) * vectors.col(k).transpose() / value;
      log_det_information += std::log(value);
    } else {
      null.conservativeResize(Eigen::NoChange, null.cols() + 1);
      null.rightCols<1>() = vectors.col(k).normalized();
    }
  }
  log_det_information -= 2.0 * scale.array().log().sum();
  out->null_space = null;
  out->log_det = -log_det_information;
  return std::isfinite(out->log_det);
}

}  // namespace circline
