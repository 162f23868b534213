#include "circline/estimators/conic_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "circline/estimators/geometric_residuals.h"

namespace circline {
namespace {

constexpr double kSqrt2 = 1.4142135623730951;

double Weight(const std::vector<double>* weights, std::size_t i) {
  return weights == nullptr ? 1.0 : (*weights)[i];
}

// Gradient of x^T C x with respect to ConicToVector(C).
Vector6d Monomials(const Eigen::Vector2d& x) {
  Vector6d m;
  m << x.x() * x.x(), x.y() * x.y(), 1.0, kSqrt2 * x.x() * x.y(), kSqrt2 * x.x(), kSqrt2 * x.y();
  return m;
}

// Similarity x = scale x' + center under which the points have mean 0 and mean square radius 2: the
// normal matrices of conics need it.
struct Normalization {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  double scale = 1.0;

  Eigen::Vector2d Apply(const Eigen::Vector2d& x) const { return (x - center) / scale; }
  CalibratedPoint Apply(const CalibratedPoint& p) const {
    CalibratedPoint out;
    out.x = Apply(p.x);
    for (std::size_t i = 0; i < 4; ++i) out.x_from_pixel[i] = p.x_from_pixel[i] / scale;
    return out;
  }
  // Matrix that takes homogeneous x to x'.
  Eigen::Matrix3d Matrix() const {
    Eigen::Matrix3d T;
    T << 1.0 / scale, 0.0, -center.x() / scale, 0.0, 1.0 / scale, -center.y() / scale, 0.0, 0.0,
        1.0;
    return T;
  }
};

bool Normalize(const std::vector<CalibratedPoint>& points, const std::vector<double>* weights,
               Normalization* normalization) {
  double sum = 0.0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    sum += Weight(weights, i);
    mean += Weight(weights, i) * points[i].x;
  }
  if (!(sum > 0.0)) return false;
  mean /= sum;
  double square = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    square += Weight(weights, i) * (points[i].x - mean).squaredNorm();
  }
  square /= sum;
  if (!(square > 0.0) || !std::isfinite(square)) return false;
  normalization->center = mean;
  normalization->scale = std::sqrt(0.5 * square);
  return true;
}

// Kanatani and Rangarajan's constraint matrix without its O(1/n) terms, in the basis of Monomials:
// N = mean(V0) + (m e^T + e m^T), V0 = sum of the squared derivatives, m = mean monomials, and e
// the expectation of the monomials' second-order error (1 for x^2 and y^2).
Eigen::Matrix3d SolveHyper(const Matrix6d& M, const Matrix6d& N) {
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(M);
  // Noise-free points make M singular: its null vector is then the answer, and stays so with the
  // eigenvalues clamped at rounding.
  const Vector6d d =
      eigen.eigenvalues().cwiseMax(1e-15 * eigen.eigenvalues()[5]).cwiseSqrt().cwiseInverse();
  const Matrix6d whitener = eigen.eigenvectors() * d.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> general(
      Matrix6d(whitener.transpose() * N * whitener));
  const int best = std::abs(general.eigenvalues()[0]) > std::abs(general.eigenvalues()[5]) ? 0 : 5;
  return VectorToConic((whitener * general.eigenvectors().col(best)).normalized());
}

// Halir and Flusser's numerically stable form of Fitzgibbon's ellipse-constrained fit; M is the
// scatter of the monomials, any order of which splits into quadratic and linear parts.
bool SolveHalirFlusser(const Matrix6d& M, Eigen::Matrix3d* conic) {
  // Quadratic (x^2, sqrt2 xy, y^2) and linear (sqrt2 x, sqrt2 y, 1) parts in the order of
  // Monomials.
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
  if (!T.allFinite()) return false;
  const Eigen::Matrix3d reduced = S1 + S2 * T;
  // In this basis the constraint 4ac - b^2 = 4 (a c - b'^2 / 2), b = sqrt2 b', has the inverse
  // below (up to scale).
  Eigen::Matrix3d inverse_constraint;
  inverse_constraint << 0.0, 0.0, 1.0, 0.0, -1.0, 0.0, 1.0, 0.0, 0.0;
  const Eigen::EigenSolver<Eigen::Matrix3d> eigen(inverse_constraint * reduced);
  double best_value = 0.0;
  bool found = false;
  for (int k = 0; k < 3; ++k) {
    const Eigen::Vector3d q = eigen.eigenvectors().col(k).real();
    const double ellipse = q[0] * q[2] - 0.5 * q[1] * q[1];
    if (!(ellipse > best_value * q.squaredNorm())) continue;
    best_value = ellipse / q.squaredNorm();
    const Eigen::Vector3d l = T * q;
    Vector6d v;
    v << q[0], q[2], l[2], q[1], l[0], l[1];
    *conic = VectorToConic(v.normalized());
    found = true;
  }
  return found;
}

struct NormalEquations {
  Matrix6d information;
  Vector6d gradient;
  double cost, weight;
};

NormalEquations Linearize(const std::vector<CalibratedPoint>& points,
                          const std::vector<double>* weights, const Eigen::Matrix3d& conic) {
  NormalEquations e{Matrix6d::Zero(), Vector6d::Zero(), 0.0, 0.0};
  Vector6d jacobian;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double w = Weight(weights, i);
    if (w == 0.0) continue;
    const double r = ConicDistance(points[i], conic, &jacobian);
    e.information.selfadjointView<Eigen::Lower>().rankUpdate(jacobian, w);
    e.gradient += (w * r) * jacobian;
    e.cost += w * r * r;
    e.weight += w;
  }
  e.information.triangularView<Eigen::StrictlyUpper>() = e.information.transpose();
  return e;
}

// Levenberg-Marquardt over unit conic vectors. The scale of the vector is no parameter: adding
// kappa v v^T to the normal matrix pins it without touching the rest.
bool MinimizeDistances(const std::vector<CalibratedPoint>& points,
                       const std::vector<double>* weights, Eigen::Matrix3d* conic,
                       NormalEquations* final_equations) {
  NormalEquations e = Linearize(points, weights, *conic);
  if (!std::isfinite(e.cost)) return false;
  double damping = 1e-4;
  constexpr int kMaxIterations = 50;
  for (int iteration = 0; iteration < kMaxIterations; ++iteration) {
    const Vector6d v = ConicToVector(*conic);
    const double kappa = e.information.trace();
    Matrix6d A = e.information + kappa * v * v.transpose();
    A.diagonal() += damping * e.information.diagonal();
    const Vector6d step = -A.ldlt().solve(e.gradient);
    if (!step.allFinite()) return false;
    Eigen::Matrix3d candidate;
    const bool is_ellipse = NormalizeEllipse(VectorToConic(v + step), &candidate);
    NormalEquations next;
    if (is_ellipse) next = Linearize(points, weights, candidate);
    if (is_ellipse && next.cost <= e.cost) {
      const bool converged = step.squaredNorm() < 1e-22 || e.cost - next.cost <= 1e-14 * e.cost;
      *conic = candidate;
      e = next;
      damping = std::max(1e-12, 0.1 * damping);
      if (converged) break;
    } else {
      if (step.squaredNorm() < 1e-22 || damping > 1e10) break;
      damping = std::max(1e-8, 10.0 * damping);
    }
  }
  *final_equations = e;
  return true;
}

// Covariance of the unit conic vector in original coordinates from the normal equations in
// normalised ones.
bool ConicCovariance(const NormalEquations& e, const Eigen::Matrix3d& normalized_conic,
                     const Normalization& normalization, double sigma_px, ConicFit* fit) {
  const Vector6d v = ConicToVector(normalized_conic);
  const double kappa = e.information.trace() / 5.0;
  Matrix6d A = e.information + kappa * v * v.transpose();
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(A);
  if (!(eigen.eigenvalues()[0] > 1e-14 * eigen.eigenvalues()[5]))
    return false;  // 5 dof not observed.
  Matrix6d covariance = eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() *
                            eigen.eigenvectors().transpose() -
                        v * v.transpose() / kappa;
  const Eigen::Matrix3d T = normalization.Matrix();
  Matrix6d linear;
  for (int i = 0; i < 6; ++i) {
    linear.col(i) = ConicToVector(TransformConic(VectorToConic(Vector6d::Unit(i)), T));
  }
  const Vector6d w = linear * v;
  const Vector6d unit = w.normalized();
  const Matrix6d project = (Matrix6d::Identity() - unit * unit.transpose()) * linear / w.norm();
  covariance = sigma_px * sigma_px * project * covariance * project.transpose();
  covariance = 0.5 * (covariance + covariance.transpose()).eval();
  if (!NormalizeEllipse(VectorToConic(unit), &fit->conic)) return false;
  Eigen::Map<Matrix6d>(fit->covariance.data()) = covariance;
  return covariance.allFinite();
}

std::vector<CalibratedPoint> Normalized(const std::vector<CalibratedPoint>& points,
                                        const Normalization& normalization) {
  std::vector<CalibratedPoint> out;
  out.reserve(points.size());
  for (const CalibratedPoint& p : points) out.push_back(normalization.Apply(p));
  return out;
}

Status NoEllipse() {
  return Status::Refused("the points lie on no ellipse (collinear, or a hyperbola)");
}

Status FitDirectNormalized(const std::vector<CalibratedPoint>& points,
                           const std::vector<double>* weights, Eigen::Matrix3d* conic) {
  Matrix6d M = Matrix6d::Zero(), N = Matrix6d::Zero();
  Vector6d mean = Vector6d::Zero();
  double sum = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const double w = Weight(weights, i);
    const double x = points[i].x.x(), y = points[i].x.y();
    const Vector6d m = Monomials(points[i].x);
    Vector6d dx, dy;
    dx << 2.0 * x, 0.0, 0.0, kSqrt2 * y, kSqrt2, 0.0;
    dy << 0.0, 2.0 * y, 0.0, kSqrt2 * x, 0.0, kSqrt2;
    M += w * m * m.transpose();
    N += w * (dx * dx.transpose() + dy * dy.transpose());
    mean += w * m;
    sum += w;
  }
  M /= sum;
  N /= sum;
  mean /= sum;
  Vector6d e;
  e << 1.0, 1.0, 0.0, 0.0, 0.0, 0.0;
  N += mean * e.transpose() + e * mean.transpose();
  Eigen::Matrix3d candidate = SolveHyper(M, N);
  if (candidate.allFinite() && NormalizeEllipse(candidate, conic)) return Status::Ok();
  if (SolveHalirFlusser(M, &candidate) && NormalizeEllipse(candidate, conic)) return Status::Ok();
  return NoEllipse();
}

Status RefineNormalized(const std::vector<CalibratedPoint>& points,
                        const Normalization& normalization, const std::vector<double>* weights,
                        double sigma_px, const Eigen::Matrix3d& initial, ConicFit* fit) {
  Eigen::Matrix3d conic = initial;
  NormalEquations e;
  if (!MinimizeDistances(points, weights, &conic, &e) ||
      !ConicCovariance(e, conic, normalization, sigma_px, fit)) {
    return NoEllipse();
  }
  fit->rms_px = std::sqrt(e.cost / e.weight);
  return Status::Ok();
}

}  // namespace

Status FitConicDirect(const std::vector<CalibratedPoint>& points, Eigen::Matrix3d* conic,
                      const std::vector<double>* weights) {
  if (points.size() < 5) return Status::Refused("an ellipse needs five points");
  Normalization normalization;
  if (!Normalize(points, weights, &normalization)) return NoEllipse();
  Eigen::Matrix3d normalized;
  Status status = FitDirectNormalized(Normalized(points, normalization), weights, &normalized);
  if (!status.ok()) return status;
  return NormalizeEllipse(TransformConic(normalized, normalization.Matrix()), conic) ? Status::Ok()
                                                                                     : NoEllipse();
}

Status FitConic(const std::vector<CalibratedPoint>& points, double sigma_px, ConicFit* fit,
                const std::vector<double>* weights) {
  if (points.size() < 5) return Status::Refused("an ellipse needs five points");
  Normalization normalization;
  if (!Normalize(points, weights, &normalization)) return NoEllipse();
  const std::vector<CalibratedPoint> normalized = Normalized(points, normalization);
  Eigen::Matrix3d initial;
  Status status = FitDirectNormalized(normalized, weights, &initial);
  if (!status.ok()) return status;
  return RefineNormalized(normalized, normalization, weights, sigma_px, initial, fit);
}

Status RefineConic(const std::vector<CalibratedPoint>& points, double sigma_px,
                   const Eigen::Matrix3d& initial, ConicFit* fit,
                   const std::vector<double>* weights) {
  if (points.size() < 5) return Status::Refused("an ellipse needs five points");
  Normalization normalization;
  if (!Normalize(points, weights, &normalization)) return NoEllipse();
  Eigen::Matrix3d normalized;
  if (!NormalizeEllipse(TransformConic(initial, normalization.Matrix().inverse()), &normalized)) {
    return Status::Refused("the initial conic is not an ellipse");
  }
  return RefineNormalized(Normalized(points, normalization), normalization, weights, sigma_px,
                          normalized, fit);
}

bool ConicFromFivePoints(const std::array<Eigen::Vector2d, 5>& x, Eigen::Matrix3d* conic) {
  // Conics through x0..x3 form the pencil of the line pairs (01)(23) and (02)(13).
  const auto line = [&x](std::size_t i, std::size_t j) -> Eigen::Vector3d {
    const Eigen::Vector2d d = x[j] - x[i];
    return {-d.y(), d.x(), d.y() * x[i].x() - d.x() * x[i].y()};
  };
  const Eigen::Vector3d l01 = line(0, 1), l23 = line(2, 3), l02 = line(0, 2), l13 = line(1, 3);
  const Eigen::Vector3d p(x[4].x(), x[4].y(), 1.0);
  const double alpha = l01.dot(p) * l23.dot(p), beta = l02.dot(p) * l13.dot(p);
  const Eigen::Matrix3d A = l01 * l23.transpose(), B = l02 * l13.transpose();
  const Eigen::Matrix3d C = beta * (A + A.transpose()) - alpha * (B + B.transpose());
  const double norm = C.norm();
  if (!(norm > 0.0) || !std::isfinite(norm)) return false;
  *conic = C / norm;
  return true;
}

}  // namespace circline
