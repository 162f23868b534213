// A robust sum of costs as residuals that ceres can solve for. Internal: not installed.
#ifndef CIRCLINE_REFINE_SQUARE_ROOT_H_
#define CIRCLINE_REFINE_SQUARE_ROOT_H_

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace circline {

// U (size x n) and f with U^T U = h, U^T f = g and |f|^2 <= twice_cost, so that the residuals (f,
// sqrt(twice_cost - |f|^2)), the last with derivative zero, have the cost, the gradient and the
// Gauss-Newton Hessian of the sum.
template <int kMax>
struct SquareRoot {
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, kMax, kMax> U;
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMax, 1> f;
  double rest = 0.0;  // sqrt(twice_cost - |f|^2).

  // Cholesky's factors with pivots, of h scaled to a unit diagonal. At most `max_rank` rows: what
  // is known to be without information (the scale of a conic) would else be rounding. Rows without
  // information are zero.
  template <typename Matrix, typename Vector>
  SquareRoot(const Matrix& h, const Vector& g, double twice_cost, int max_rank) {
    constexpr double kNoInformation = 1e-13;
    const Eigen::Index n = h.rows();
    U.setZero(max_rank, n);
    f.setZero(max_rank);
    // As fixed in size as h.
    constexpr int kSize = Matrix::ColsAtCompileTime, kMaxSize = Matrix::MaxColsAtCompileTime;
    using Column = Eigen::Matrix<double, kSize, 1, 0, kMaxSize, 1>;
    Column scale(n), b(n);
    Eigen::Matrix<double, kSize, kSize, 0, kMaxSize, kMaxSize> A(n, n);
    for (Eigen::Index i = 0; i < n; ++i) scale[i] = h(i, i) > 0.0 ? 1.0 / std::sqrt(h(i, i)) : 0.0;
    A = scale.asDiagonal() * h * scale.asDiagonal();
    b = scale.cwiseProduct(g);
    for (Eigen::Index k = 0; k < max_rank; ++k) {
      Eigen::Index pivot;
      if (!(A.diagonal().maxCoeff(&pivot) > kNoInformation)) break;
      const double inverse = 1.0 / std::sqrt(A(pivot, pivot));
      const Column u = inverse * A.col(pivot);
      f[k] = inverse * b[pivot];
      for (Eigen::Index j = 0; j < n; ++j) A.col(j) -= u[j] * u;
      b -= f[k] * u;
      A.row(pivot).setZero();
      A.col(pivot).setZero();
      b[pivot] = 0.0;
      for (Eigen::Index i = 0; i < n; ++i) U(k, i) = scale[i] > 0.0 ? u[i] / scale[i] : 0.0;
    }
    // Far from a minimum a bent loss may promise more than there is: a stiffer Hessian, same
    // gradient.
    constexpr double kNothing = 1e-9;  // Of cost: what rounding leaves of a perfect fit.
    const double promised = f.squaredNorm();
    if (promised > twice_cost + kNothing) {
      const double stiffer = std::sqrt(promised / (twice_cost + kNothing));
      U *= stiffer;
      f /= stiffer;
    }
    rest = std::sqrt(std::max(0.0, twice_cost - f.squaredNorm()));
  }
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_SQUARE_ROOT_H_
