// Some entries of the inverse of a sparse matrix. Internal: not installed.
#ifndef CIRCLINE_REFINE_JOINT_INVERSE_ON_PATTERN_H_
#define CIRCLINE_REFINE_JOINT_INVERSE_ON_PATTERN_H_

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace circline {

// Of the inverse of a symmetric positive definite matrix the entries where its Cholesky factor has
// one: all that are not zero in the matrix, the covariances within a block and between blocks that
// share a residual. In about the time of a few factorisations (Takahashi, Fagan and Chin 1973).
class InverseOnPattern {
 public:
  using Sparse = Eigen::SparseMatrix<double>;

  explicit InverseOnPattern(const Sparse& matrix) : factor_(matrix) {
    if (ok()) Invert();
  }
  bool ok() const { return factor_.info() == Eigen::Success && factor_.vectorD().minCoeff() > 0.0; }
  // Zero outside the pattern.
  double operator()(int row, int col) const {
    const auto& order = factor_.permutationP().indices();
    const int i = std::max(order[row], order[col]), j = std::min(order[row], order[col]);
    return i == j ? diagonal_[i] : inverse_.coeff(i, j);
  }
  // The inverse times this.
  Eigen::MatrixXd Times(const Eigen::MatrixXd& right) const { return factor_.solve(right); }

 private:
  // With A = L D L': the column j of the inverse Z below the diagonal is -Z_II L_Ij, where I are
  // the rows of L's column j, and Z_jj = 1 / d_j - L_Ij' Z_Ij; from the last column to the first.
  void Invert() {
    inverse_ = factor_.matrixL().nestedExpression().triangularView<Eigen::StrictlyLower>();
    const Sparse L = inverse_;
    const Eigen::VectorXd d = factor_.vectorD();
    diagonal_ = d.cwiseInverse();
    Eigen::VectorXd own = Eigen::VectorXd::Zero(d.size()), sum = own;
    std::vector<std::uint8_t> is_own(static_cast<std::size_t>(d.size()), 0);
    for (int j = static_cast<int>(d.size()) - 1; j >= 0; --j) {
      for (Sparse::InnerIterator l(L, j); l; ++l) {
        own[l.row()] = l.value();
        is_own[static_cast<std::size_t>(l.row())] = 1;
      }
      for (Sparse::InnerIterator l(L, j); l; ++l) {
        const auto k = l.row();
        double at_k = diagonal_[k] * l.value();
        for (Sparse::InnerIterator z(inverse_, k); z; ++z) {
          if (is_own[static_cast<std::size_t>(z.row())] == 0) continue;
          at_k += z.value() * own[z.row()];
          sum[z.row()] += z.value() * l.value();
        }
        sum[k] += at_k;
      }
      for (Sparse::InnerIterator z(inverse_, j); z; ++z) {
        const auto k = z.row();
        z.valueRef() = -sum[k];
        diagonal_[j] += own[k] * sum[k];
        own[k] = sum[k] = 0.0;
        is_own[static_cast<std::size_t>(k)] = 0;
      }
    }
  }

  Eigen::SimplicialLDLT<Sparse> factor_;
  Sparse inverse_;  // Below the diagonal, in the factor's order.
  Eigen::VectorXd diagonal_;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_JOINT_INVERSE_ON_PATTERN_H_
