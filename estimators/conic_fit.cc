#include "circline/estimators/conic_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "circline/estimators/cholesky6.h"
#include "circline/estimators/conic_distance.h"
#include "circline/estimators/conic_moments.h"
#include "circline/estimators/weights.h"

namespace circline {
namespace {

// What TransformConic by T does to ConicToVector, as a matrix.
Matrix6d VectorTransform(const Eigen::Matrix3d& T) {
  Matrix6d linear;
  for (int i = 0; i < 6; ++i) {
    linear.col(i) = ConicToVector(TransformConic(VectorToConic(Vector6d::Unit(i)), T));
  }
  return linear;
}

// Covariance of the unit conic vector in original coordinates from the normal equations in
// normalised ones. False where the points do not determine all of its 5 degrees of freedom.
bool ConicCovariance(const PointDistances::NormalEquations& e,
                     const Eigen::Matrix3d& normalized_conic, const Normalization& normalization,
                     double sigma_px, ConicFit* fit) {
  const Vector6d v = ConicToVector(normalized_conic);
  const double kappa = e.information.trace() / 5.0;
  const Matrix6d A = e.information + kappa * v * v.transpose();
  Matrix6d L;
  Vector6d d;
  if (!Cholesky(A, 1e-14, &L, &d)) return false;

  // Project what T does onto the tangent space of the unit vector; v itself (the gauge, pinned with
  // the variance 1/kappa) has no part in it. The covariance is then X^T X with X = L^-1 project^T.
  const Matrix6d linear = VectorTransform(normalization.Matrix());
  const Vector6d w = linear.lazyProduct(v);
  const Vector6d unit = w.normalized();
  const Vector6d along = linear.transpose().lazyProduct(unit);
  Matrix6d X = (linear - unit * along.transpose()).transpose() * (sigma_px / w.norm());
  SolveLower(L, d, &X);
  const Matrix6d covariance = X.transpose().lazyProduct(X);
  if (!NormalizeEllipse(VectorToConic(unit), &fit->conic)) return false;
  Eigen::Map<Matrix6d>(fit->covariance.data()) = covariance;
  return covariance.allFinite();
}

Status NoEllipse() {
  return Status::Refused("the points lie on no ellipse (collinear, or a hyperbola)");
}

// What is to be fitted.
struct Problem {
  const std::vector<CalibratedPoint>& points;
  const std::vector<double>* weights;
  double sigma_px;
  std::vector<double>* memory;  // May be null.
  Normalization normalization;
  Moments means;

  bool Normalize() { return NormalizePoints(points, weights, &normalization, &means); }
};

// Whether the points lie on a branch of a hyperbola: the best ellipse has run off towards a
// parabola, and a conic that may be anything explains them better by five standard deviations.
bool IsHyperbola(const Problem& problem, const Minimum& best) {
  const Eigen::Matrix2d H = best.conic.topLeftCorner<2, 2>();
  constexpr double kParabola = 1e-2;  // Squared ratio of the axes, about.
  if (H.determinant() > kParabola * H.trace() * H.trace()) return false;
  const Eigen::Matrix3d any =
      TransformConic(FitAnyConic(problem.means), problem.normalization.Matrix());
  double cost = 0.0;
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    const double r = ConicDistancePx(problem.points[i], any);
    cost += WeightAt(problem.weights, i) * r * r;
  }
  constexpr double kGate = 25.0;
  const double freedom = std::max(1.0, static_cast<double>(problem.points.size()) - 5.0);
  return best.equations.cost > (1.0 + kGate / freedom) * cost;
}

// `other` (optional): where to look for a second minimum if the first was hard to reach.
Status Refine(const Problem& problem, const Eigen::Matrix3d& initial, const Eigen::Matrix3d* other,
              ConicFit* fit) {
  PointDistances contour(problem.points, problem.weights, problem.normalization, problem.memory);
  Minimum best;
  bool found = MinimizeDistances(initial, &contour, &best);
  constexpr int kHard = 7;  // Three steps are usual; more say that the cost is far from quadratic.
  if (other != nullptr && (!found || best.iterations > kHard)) {
    Minimum second;
    if (MinimizeDistances(*other, &contour, &second) &&
        (!found || second.equations.cost < best.equations.cost)) {
      best = second;
      found = true;
    }
  }
  ConicFit result;
  if (!found || IsHyperbola(problem, best) ||
      !ConicCovariance(best.equations, best.conic, problem.normalization, problem.sigma_px,
                       &result)) {
    return NoEllipse();
  }
  result.rms_px = std::sqrt(best.equations.cost / best.equations.weight);
  if (!std::isfinite(result.rms_px)) return NoEllipse();
  *fit = result;
  return Status::Ok();
}

}  // namespace

Status FitConicDirect(const std::vector<CalibratedPoint>& points, Eigen::Matrix3d* conic,
                      const std::vector<double>* weights) {
  if (points.size() < 5) return Status::Refused("an ellipse needs five points");
  Normalization normalization;
  Moments means;
  Eigen::Matrix3d normalized;
  if (!NormalizePoints(points, weights, &normalization, &means) ||
      !FitEllipse(means, &normalized) ||
      !NormalizeEllipse(TransformConic(normalized, normalization.Matrix()), conic)) {
    return NoEllipse();
  }
  return Status::Ok();
}

Status FitConic(const std::vector<CalibratedPoint>& points, double sigma_px, ConicFit* fit,
                const std::vector<double>* weights, std::vector<double>* memory) {
  if (points.size() < 5) return Status::Refused("an ellipse needs five points");
  Problem problem{points, weights, sigma_px, memory, {}, {}};
  Eigen::Matrix3d initial, circle;
  if (!problem.Normalize() || !FitEllipse(problem.means, &initial)) return NoEllipse();
  const bool has_circle = FitCircle(problem.means, &circle);
  return Refine(problem, initial, has_circle ? &circle : nullptr, fit);
}

Status RefineConic(const std::vector<CalibratedPoint>& points, double sigma_px,
                   const Eigen::Matrix3d& initial, ConicFit* fit,
                   const std::vector<double>* weights) {
  if (points.size() < 5) return Status::Refused("an ellipse needs five points");
  Problem problem{points, weights, sigma_px, nullptr, {}, {}};
  if (!problem.Normalize()) return NoEllipse();
  Eigen::Matrix3d normalized;
  if (!NormalizeEllipse(TransformConic(initial, problem.normalization.Inverse()), &normalized)) {
    return Status::Refused("the initial conic is not an ellipse");
  }
  return Refine(problem, normalized, nullptr, fit);
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
