// A robust sum of costs as residuals that ceres can solve for. Internal: not installed.
#ifndef CIRCLINE_REFINE_SQUARE_ROOT_H_
#define CIRCLINE_REFINE_SQUARE_ROOT_H_

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <type_traits>

#include "circline/refine/image_points.h"

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
  // information are zero. Of the first `lead` columns, which have a rank of `lead_rank`, nothing is
  // lost, whatever the others would need.
  template <typename Matrix, typename Vector>
  SquareRoot(const Matrix& h, const Vector& g, double twice_cost, int max_rank, int lead,
             int lead_rank) {
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
      if (k >= lead_rank || !(A.diagonal().head(lead).maxCoeff(&pivot) > kNoInformation)) {
        if (!(A.diagonal().maxCoeff(&pivot) > kNoInformation)) break;
      }
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

// Of a curve's model; most have no more variables than their curve.
template <int kMax>
SquareRoot<kMax> SquareRootOf(const CurveModel& model, int max_rank, int lead, int lead_rank) {
  const auto of_size = [&](const auto& size) {
    constexpr int kSize = std::decay_t<decltype(size)>::value;
    return SquareRoot<kMax>(Eigen::Matrix<double, kSize, kSize>(model.h),
                            Eigen::Matrix<double, kSize, 1>(model.g), model.twice_cost, max_rank,
                            lead, lead_rank);
  };
  switch (model.g.size()) {
    case 3:
      return of_size(std::integral_constant<int, 3>());
    case 6:
      return of_size(std::integral_constant<int, 6>());
    case 7:
      return of_size(std::integral_constant<int, 7>());
    default:
      return SquareRoot<kMax>(model.h, model.g, model.twice_cost, max_rank, lead, lead_rank);
  }
}

}  // namespace circline

#endif  // CIRCLINE_REFINE_SQUARE_ROOT_H_
