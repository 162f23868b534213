// Closed forms for the focal length as functions of a vector of inputs, and their first-order
// errors. Internal: not installed.
#ifndef CIRCLINE_ESTIMATORS_FOCAL_ROOTS_H_
#define CIRCLINE_ESTIMATORS_FOCAL_ROOTS_H_

#include <Eigen/Dense>
#include <array>
#include <cmath>

#include "circline/estimators/conic_fit.h"
#include "circline/estimators/focal_length.h"

namespace circline {

constexpr double kRounding = 1e-12;  // Of what is scaled to 1.

// Log f open by more than a factor of e is no answer.
constexpr double kMaxLogFocalVariance = 1.0;

template <int N>
using Vector = Eigen::Matrix<double, N, 1>;

inline int RefuseFocal(FocalRefusal reason, FocalRefusal* why) {
  if (why != nullptr) *why = reason;
  return 0;
}

// Measured inputs, independent of one another, one after the other.
template <int N>
struct FocalInputs {
  Vector<N> z = Vector<N>::Zero();
  Eigen::Matrix<double, N, N> covariance = Eigen::Matrix<double, N, N>::Zero();
  Eigen::Matrix<double, N, 2> shift = Eigen::Matrix<double, N, 2>::Zero();  // Per principal point.
  bool are_ellipses = true;                                                 // All conics.

  void SetPoint(int at, const Eigen::Vector3d& v, const Eigen::Matrix3d& v_covariance) {
    const double norm = v.norm();
    z.template segment<3>(at) = v / norm;
    covariance.template block<3, 3>(at, at) = v_covariance / (norm * norm);
    shift(at, 0) = shift(at + 1, 1) = -v.z() / norm;
  }
  void SetConic(int at, const ConicFit& fit) {
    z.template segment<6>(at) = ConicToVector(fit.conic);
    covariance.template block<6, 6>(at, at) = fit.Covariance();
    for (int k = 0; k < 2; ++k) {
      const Eigen::Matrix3d half = fit.conic.col(k) * Eigen::RowVector3d::UnitZ();
      shift.template block<6, 1>(at, k) = ConicToVector(half + half.transpose());
    }
    Eigen::Matrix3d normalized;
    are_ellipses = NormalizeEllipse(fit.conic, &normalized) && are_ellipses;
  }
  // Why there can be no solution, if there cannot.
  FocalRefusal Why() const {
    if (!z.allFinite() || !covariance.allFinite()) return FocalRefusal::kNotFinite;
    return are_ellipses ? FocalRefusal::kNone : FocalRefusal::kNoEllipse;
  }
};

// f^2 of up to two solutions, and what became of the others.
struct FocalRoots {
  int count = 0;
  std::array<double, 2> squared{};
  FocalRefusal why = FocalRefusal::kNone;

  FocalRoots() = default;
  explicit FocalRoots(FocalRefusal reason) : why(reason) {}
  void Add(double value) {
    if (value > 0.0) {
      squared[static_cast<std::size_t>(count++)] = value;
    } else {
      why = FocalRefusal::kNotPositive;
    }
  }
  // The one nearest to `value`, NaN where there is none.
  double Nearest(double value) const {
    if (count == 0) return std::nan("");
    const bool second = count == 2 && std::abs(squared[1] - value) < std::abs(squared[0] - value);
    return squared[second ? 1 : 0];
  }
};

// Gradient of log f by the inputs, central differences. The step is one of vectors of unit length.
template <int N, typename Solve>
Vector<N> LogFocalGradient(const Solve& solve, const Vector<N>& z, double squared) {
  constexpr double kStep = 1e-7;
  Vector<N> gradient;
  for (int k = 0; k < N; ++k) {
    const Vector<N> step = kStep * Vector<N>::Unit(k);
    const double ratio =
        solve(Vector<N>(z + step)).Nearest(squared) / solve(Vector<N>(z - step)).Nearest(squared);
    gradient[k] = 0.25 / kStep * std::log(ratio);
  }
  return gradient;
}

// The solutions of `solve(inputs)` with their first-order errors.
template <int N, typename Solve>
int FocalSolutionsOf(const Solve& solve, const FocalInputs<N>& inputs, FocalSolution* solutions,
                     FocalRefusal* why) {
  const Vector<N>& z = inputs.z;
  if (inputs.Why() != FocalRefusal::kNone) return RefuseFocal(inputs.Why(), why);
  const FocalRoots roots = solve(z);
  FocalRefusal reason = roots.why;
  int count = 0;
  for (int i = 0; i < roots.count; ++i) {
    const double squared = roots.squared[static_cast<std::size_t>(i)];
    const Vector<N> gradient = LogFocalGradient<N>(solve, z, squared);
    const double variance = gradient.dot(inputs.covariance * gradient);
    if (!(variance >= 0.0 && variance < kMaxLogFocalVariance)) {
      reason = FocalRefusal::kUndetermined;
      continue;
    }
    solutions[count++] = {std::sqrt(squared), variance, inputs.shift.transpose() * gradient, 0.0};
  }
  return count > 0 ? count : RefuseFocal(reason, why);
}

// One focal length from K closed forms of the same inputs, `solve(inputs)` an array of FocalRoots
// with one each: the mean log f of the least variance, without those that say nothing.
template <std::size_t K, int N, typename Solve>
int CombinedSolution(const Solve& solve, const FocalInputs<N>& inputs, FocalSolution* solution,
                     FocalRefusal* why) {
  if (inputs.Why() != FocalRefusal::kNone) return RefuseFocal(inputs.Why(), why);
  constexpr double kRounding2 = 1e-24;  // Of log f, squared.
  constexpr int kSize = static_cast<int>(K);
  Eigen::Matrix<double, N, kSize> gradients = Eigen::Matrix<double, N, kSize>::Zero();
  Vector<kSize> log_focal = Vector<kSize>::Zero(), present = Vector<kSize>::Zero();
  FocalRefusal reason = FocalRefusal::kNone;
  const std::array<FocalRoots, K> roots = solve(inputs.z);
  for (std::size_t k = 0; k < K; ++k) {
    if (roots[k].count == 0) {
      reason = roots[k].why;
      continue;
    }
    const double squared = roots[k].squared[0];
    const Vector<N> gradient = LogFocalGradient<N>(
        [&solve, k](const Vector<N>& z) { return solve(z)[k]; }, inputs.z, squared);
    if (!(gradient.dot(inputs.covariance * gradient) < kMaxLogFocalVariance)) {
      reason = FocalRefusal::kUndetermined;
      continue;
    }
    const auto column = static_cast<Eigen::Index>(k);
    gradients.col(column) = gradient;
    log_focal[column] = 0.5 * std::log(squared);
    present[column] = 1.0;
  }
  if (present.isZero()) return RefuseFocal(reason, why);
  Eigen::Matrix<double, kSize, kSize> covariance =
      gradients.transpose() * inputs.covariance * gradients;
  covariance.diagonal().array() += kRounding2;
  covariance.diagonal() += Vector<kSize>::Ones() - present;
  Vector<kSize> weights = covariance.inverse() * present;
  weights /= weights.sum();
  const Vector<N> gradient = gradients * weights;
  *solution = {std::exp(weights.dot(log_focal)), gradient.dot(inputs.covariance * gradient),
               inputs.shift.transpose() * gradient, 0.0};
  return 1;
}

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_FOCAL_ROOTS_H_
