// Symmetric 6x6 systems, unrolled: a third of the time of the general solvers. Internal: not
// installed.
#ifndef CIRCLINE_ESTIMATORS_CHOLESKY6_H_
#define CIRCLINE_ESTIMATORS_CHOLESKY6_H_

#include <Eigen/Core>
#include <cmath>

#include "circline/estimators/conic.h"

namespace circline {

// L with L L^T = A, written to the lower triangle, and the reciprocals of its diagonal. A pivot
// below `min_pivot` of its diagonal entry is rounding: it is raised to that. Returns whether none
// was.
inline bool Cholesky(const Matrix6d& A, double min_pivot, Matrix6d* L, Vector6d* inverse_diagonal) {
  bool positive = true;
  for (int j = 0; j < 6; ++j) {
    double pivot = A(j, j);
    for (int k = 0; k < j; ++k) pivot -= (*L)(j, k) * (*L)(j, k);
    if (!(pivot > min_pivot * A(j, j))) {
      pivot = min_pivot * A(j, j);
      positive = false;
    }
    const double inverse = 1.0 / std::sqrt(pivot);
    (*inverse_diagonal)[j] = inverse;
    (*L)(j, j) = pivot * inverse;
    for (int i = j + 1; i < 6; ++i) {
      double sum = A(i, j);
      for (int k = 0; k < j; ++k) sum -= (*L)(i, k) * (*L)(j, k);
      (*L)(i, j) = sum * inverse;
    }
  }
  return positive;
}

// X <- L^-1 X.
template <typename Derived>
void SolveLower(const Matrix6d& L, const Vector6d& inverse_diagonal,
                Eigen::MatrixBase<Derived>* X) {
  for (int i = 0; i < 6; ++i) {
    for (int k = 0; k < i; ++k) X->row(i) -= L(i, k) * X->row(k);
    X->row(i) *= inverse_diagonal[i];
  }
}

// X <- L^-T X.
template <typename Derived>
void SolveUpper(const Matrix6d& L, const Vector6d& inverse_diagonal,
                Eigen::MatrixBase<Derived>* X) {
  for (int i = 5; i >= 0; --i) {
    for (int k = i + 1; k < 6; ++k) X->row(i) -= L(k, i) * X->row(k);
    X->row(i) *= inverse_diagonal[i];
  }
}

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_CHOLESKY6_H_
