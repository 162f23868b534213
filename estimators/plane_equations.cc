#include "circline/estimators/plane_equations.h"

#include <Eigen/Dense>
#include <array>
#include <cmath>

#include "circline/estimators/directions.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector4d;

constexpr double kUnstatedSigma = 1e-10;  // Standard deviation of residuals that state none.

// A conic M on the plane as three numbers: (M00 - M11, 2 M01) / (M00 + M11), which are 0 for a
// circle, and the log of its radius (of the circle of its area); `rates`: d number = <rate, dM>.
struct PlaneShape {
  Vector3d value;
  std::array<Matrix3d, 3> rates;

  // False where the plane's horizon meets the conic.
  bool Set(const Matrix3d& M) {
    const double trace = M(0, 0) + M(1, 1), determinant = M.determinant();
    const double quadratic = M(0, 0) * M(1, 1) - M(0, 1) * M(0, 1);
    if (!(trace > 0.0 && quadratic > 0.0 && determinant < 0.0)) return false;
    const double u = (M(0, 0) - M(1, 1)) / trace, v = 2.0 * M(0, 1) / trace;
    value << u, v, 0.5 * std::log(-determinant) - 0.75 * std::log(quadratic);
    for (Matrix3d& rate : rates) rate.setZero();
    rates[0](0, 0) = (1.0 - u) / trace;
    rates[0](1, 1) = (-1.0 - u) / trace;
    rates[1](0, 0) = rates[1](1, 1) = -v / trace;
    rates[1](0, 1) = rates[1](1, 0) = 1.0 / trace;
    rates[2] = 0.5 * M.inverse();
    rates[2](0, 0) -= 0.75 * M(1, 1) / quadratic;
    rates[2](1, 1) -= 0.75 * M(0, 0) / quadratic;
    rates[2](0, 1) += 0.75 * M(0, 1) / quadratic;
    rates[2](1, 0) += 0.75 * M(0, 1) / quadratic;
    return true;
  }
};

// From the plane to the image.
Matrix3d ImageFromPlane(const PlaneState& state) {
  const double f = std::exp(state.log_focal);
  return Vector3d(f, f, 1.0).asDiagonal() * state.basis;
}

// Residuals with their derivatives by the state and by the principal point.
template <int N>
bool Add(const Eigen::Matrix<double, N, 1>& r, const Eigen::Matrix<double, N, 4>& J,
         const Eigen::Matrix<double, N, 2>& J_shift, Eigen::Matrix<double, N, N> covariance,
         PlaneEquations* equations) {
  covariance.diagonal().array() += kUnstatedSigma * kUnstatedSigma;
  const Eigen::Matrix<double, N, N> weight = covariance.inverse();
  const Eigen::Matrix<double, 4, N> JW = J.transpose() * weight;
  equations->information += JW * J;
  equations->gradient += JW * r;
  equations->shift += JW * J_shift;
  equations->chi2 += r.dot(weight * r);
  return std::isfinite(equations->chi2);
}

bool AddCircle(const PlaneEvidence& evidence, std::size_t index, const PlaneState& state,
               PlaneEquations* equations) {
  const ConicFit& fit = *evidence.circles[index];
  const Matrix3d G = ImageFromPlane(state), M = G.transpose() * fit.conic * G;
  PlaneShape shape;
  if (!shape.Set(M)) return false;
  Eigen::Matrix<double, 3, 4> J;
  Eigen::Matrix<double, 3, 2> J_shift;
  Eigen::Matrix<double, 3, 6> J_conic;
  for (int i = 0; i < 3; ++i) {
    const Matrix3d& rate = shape.rates[static_cast<std::size_t>(i)];
    // <rate, dM> of dM = G^T dC G is <B, dC>.
    const Matrix3d B = G * rate * G.transpose(), BC = B * fit.conic, RM = rate * M;
    J.row(i) << 2.0 * (BC(0, 0) + BC(1, 1)), 2.0 * (RM(2, 0) - RM(0, 2)),
        2.0 * (RM(2, 1) - RM(1, 2)), i == 2 ? -1.0 : 0.0;
    J_shift.row(i) = 2.0 * BC.row(2).head<2>();
    J_conic.row(i) = ConicToVector(B).transpose();
  }
  Matrix3d covariance = J_conic * fit.Covariance() * J_conic.transpose();
  covariance(2, 2) += evidence.radius_sigma * evidence.radius_sigma;
  if (!evidence.radii.empty()) {
    const double log_radius = std::log(evidence.radii[index]) + state.log_unit;
    const Vector3d r = shape.value - Vector3d(0.0, 0.0, log_radius);
    return Add<3>(r, J, J_shift, covariance, equations);
  }
  return Add<2>(shape.value.head<2>(), J.topRows<2>(), J_shift.topRows<2>(),
                covariance.topLeftCorner<2, 2>(), equations);
}

// The direction of a vanishing point at a focal length, unit, and its derivatives.
struct Direction {
  Vector3d value, by_focal;
  Matrix3d by_point, covariance;

  Direction(const VanishingPointFit& fit, double f) {
    const Vector3d scale(1.0, 1.0, f), u = scale.cwiseProduct(fit.direction);
    value = u.normalized();
    by_point = (Matrix3d::Identity() - value * value.transpose()) * scale.asDiagonal() / u.norm();
    by_focal = by_point.col(2) * fit.direction.z();
    covariance = by_point * fit.covariance * by_point.transpose();
    by_point *= -fit.direction.z();  // From here on: columns 0 and 1 by the principal point.
  }
};

bool AddPencils(const PlaneEvidence& evidence, const PlaneState& state, PlaneEquations* equations) {
  const double f = std::exp(state.log_focal);
  const double model = evidence.pencil_sigma * evidence.pencil_sigma;
  const Vector3d n = state.basis.col(2);
  const auto add = [equations, model](double r, const Eigen::Matrix<double, 1, 4>& J,
                                      const Eigen::RowVector3d& J_shift, double variance) {
    return Add<1>(Eigen::Matrix<double, 1, 1>(r), J, J_shift.leftCols<2>(),
                  Eigen::Matrix<double, 1, 1>(variance + model), equations);
  };
  for (const VanishingPointFit* fit : evidence.pencils) {
    const Direction a(*fit, f);
    Eigen::Matrix<double, 1, 4> J;
    J << n.dot(a.by_focal), a.value.transpose() * state.basis.leftCols<2>(), 0.0;
    if (!add(n.dot(a.value), J, n.transpose() * a.by_point, n.dot(a.covariance * n))) return false;
  }
  if (!evidence.orthogonal_pencils) return true;
  const Direction a(*evidence.pencils[0], f), b(*evidence.pencils[1], f);
  const Vector3d &va = a.value, &vb = b.value;
  const Eigen::RowVector4d J(a.by_focal.dot(vb) + b.by_focal.dot(va), 0.0, 0.0, 0.0);
  return add(va.dot(vb), J, vb.transpose() * a.by_point + va.transpose() * b.by_point,
             vb.dot(a.covariance * vb) + va.dot(b.covariance * va));
}

}  // namespace

bool PlaneState::Set(const Vector3d& normal, const Matrix3d& conic) {
  basis.col(2) = normal;
  basis.leftCols<2>() = BasisAcross(normal);
  const Matrix3d G = ImageFromPlane(*this);
  PlaneShape shape;
  if (!shape.Set(G.transpose() * conic * G)) return false;
  log_unit = shape.value[2];
  return true;
}

void PlaneState::Step(const Vector4d& step) {
  log_focal += step[0];
  const Vector3d n = (basis.col(2) + basis.leftCols<2>() * step.segment<2>(1)).normalized();
  const Vector3d x = (basis.col(0) - n * n.dot(basis.col(0))).normalized();
  basis << x, n.cross(x), n;
  log_unit += step[3];
}

bool PlaneEquations::Set(const PlaneEvidence& evidence, const PlaneState& state) {
  *this = PlaneEquations();
  for (std::size_t i = 0; i < evidence.circles.size(); ++i) {
    if (!AddCircle(evidence, i, state, this)) return false;
  }
  if (!AddPencils(evidence, state, this)) return false;
  if (evidence.radii.empty()) {
    // No residual holds the unit.
    information.row(3).setZero();
    information.col(3).setZero();
    information(3, 3) = 1.0;
  }
  return true;
}

}  // namespace circline
