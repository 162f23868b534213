#include "circline/estimators/conic_moments.h"

#include <Eigen/Dense>
#include <cmath>

#include "circline/estimators/cholesky6.h"
#include "circline/estimators/weights.h"

namespace circline {
namespace {

// Unit eigenvector of the eigenvalue of largest magnitude of a symmetric matrix: k squarings are
// 2^k steps of the power iteration, and a handful of them costs a fifth of all eigenvectors.
Vector6d DominantEigenvector(const Matrix6d& B) {
  Matrix6d S = B;
  constexpr int kMaxSquarings = 12;
  for (int i = 0; i < kMaxSquarings; ++i) {
    const Matrix6d square = S.lazyProduct(S);
    S = square / square.trace();
    // Eigenvalues p_i >= 0 that sum to 1: the rest is at most this, and the last product squares
    // it.
    if (1.0 - S.squaredNorm() < 1e-7) break;
  }
  Eigen::Index column;
  S.diagonal().maxCoeff(&column);
  return (S * S.col(column)).normalized();
}

// The v with M v = mu N v of the smallest |mu|.
Eigen::Matrix3d SolveHyper(const Matrix6d& M, const Matrix6d& N) {
  // Noise-free points make M singular: its null vector is then the answer, and stays so with the
  // pivots raised to rounding.
  Matrix6d L;
  Vector6d d;
  Cholesky(M, 1e-15, &L, &d);
  Matrix6d B = N;
  SolveLower(L, d, &B);
  B.transposeInPlace();
  SolveLower(L, d, &B);
  Vector6d v = DominantEigenvector(B);
  SolveUpper(L, d, &v);
  return VectorToConic(v.normalized());
}

// Halir and Flusser's numerically stable form of Fitzgibbon's ellipse-constrained fit; M is
// Moments::Scatter.
bool SolveHalirFlusser(const Matrix6d& M, Eigen::Matrix3d* conic) {
  // Where M has the monomials (x^2, sqrt2 xy, y^2) and (sqrt2 x, sqrt2 y, 1).
  constexpr int kQuadratic[3] = {0, 3, 1}, kLinear[3] = {4, 5, 2};
  Eigen::Matrix3d S1, S2, S3;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) {
      S1(i, j) = M(kQuadratic[i], kQuadratic[j]);
      S2(i, j) = M(kQuadratic[i], kLinear[j]);
      S3(i, j) = M(kLinear[i], kLinear[j]);
    }
  }
  const Eigen::Matrix3d T = -S3.ldlt().solve(S2.transpose());
  const Eigen::Matrix3d reduced = S1 + S2 * T;
  if (!reduced.allFinite()) return false;
  // In this basis the constraint 4ac - b^2 = 4 (a c - b'^2 / 2), b = sqrt2 b', has the inverse
  // below (up to scale).
  Eigen::Matrix3d inverse_constraint;
  inverse_constraint << 0.0, 0.0, 1.0, 0.0, -1.0, 0.0, 1.0, 0.0, 0.0;
  // One eigenvalue is positive, that of an ellipse, as the constraint's signature is (1, 2).
  const Eigen::EigenSolver<Eigen::Matrix3d> eigen(inverse_constraint * reduced);
  Eigen::Index largest;
  eigen.eigenvalues().real().maxCoeff(&largest);
  const Eigen::Vector3d q = eigen.eigenvectors().col(largest).real();
  if (!(q[0] * q[2] - 0.5 * q[1] * q[1] > 0.0)) return false;
  const Eigen::Vector3d l = T * q;
  Vector6d v;
  v << q[0], q[2], l[2], q[1], l[0], l[1];
  *conic = VectorToConic(v.normalized());
  return true;
}

}  // namespace

bool NormalizePoints(const std::vector<CalibratedPoint>& points, const std::vector<double>* weights,
                     Normalization* normalization, Moments* means) {
  double sum = 0.0, x = 0.0, y = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double w = WeightAt(weights, i);
    sum += w;
    x += w * points[i].x.x();
    y += w * points[i].x.y();
  }
  if (!(sum > 0.0)) return false;
  normalization->center_x = x / sum;
  normalization->center_y = y / sum;
  Moments moments;
  for (std::size_t i = 0; i < points.size(); ++i) {
    moments.Add(points[i].x.x() - normalization->center_x,
                points[i].x.y() - normalization->center_y, WeightAt(weights, i));
  }
  const double square = 0.5 * (moments.xx + moments.yy) / moments.one;
  if (!(square > 0.0) || !std::isfinite(square)) return false;
  normalization->scale = std::sqrt(square);
  *means = moments.Mean(normalization->scale);
  return std::isfinite(means->xxxx + means->xxyy + means->yyyy);
}

Eigen::Matrix3d FitAnyConic(const Moments& means) {
  return SolveHyper(means.Scatter(), means.HyperConstraint());
}

bool FitEllipse(const Moments& means, Eigen::Matrix3d* conic) {
  Eigen::Matrix3d candidate = FitAnyConic(means);
  if (candidate.allFinite() && NormalizeEllipse(candidate, conic)) return true;
  return SolveHalirFlusser(means.Scatter(), &candidate) && NormalizeEllipse(candidate, conic);
}

bool FitCircle(const Moments& m, Eigen::Matrix3d* conic) {
  Eigen::Matrix3d A;
  A << m.xx, m.xy, m.x, m.xy, m.yy, m.y, m.x, m.y, m.one;
  const Eigen::Vector3d s =
      A.ldlt().solve(-Eigen::Vector3d(m.xxx + m.xyy, m.xxy + m.yyy, m.xx + m.yy));
  Eigen::Matrix3d C;
  C << 1.0, 0.0, 0.5 * s[0], 0.0, 1.0, 0.5 * s[1], 0.5 * s[0], 0.5 * s[1], s[2];
  return NormalizeEllipse(C, conic);
}

}  // namespace circline
