// Robust losses by name. Each is rho(s) of the squared residual s = (r / sigma)^2 with rho(0) = 0
// and rho'(0) = 1; its tuning constant gives 95 % efficiency on Gaussian noise, so that one scale
// sigma serves all of them.
#ifndef CIRCLINE_ESTIMATORS_ROBUST_LOSS_H_
#define CIRCLINE_ESTIMATORS_ROBUST_LOSS_H_

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "circline/estimators/export.h"

namespace CIRCLINE_EXPORT circline {

// Which rho; kTrivial is least squares.
enum class LossType { kTrivial, kHuber, kSoftLOne, kCauchy, kArctan, kTukey, kGemanMcClure };

// "trivial", "huber", "soft_l_one", "cauchy", "arctan", "tukey", "geman_mcclure".
const char* LossName(LossType type);
// False, with `type` untouched, where no loss has this name.
bool LossFromName(const std::string& name, LossType* type);
// All of them, in the order of LossType.
std::vector<std::string> LossNames();

// The constant c at which the loss, on unit Gaussian noise, keeps 95 % of the efficiency of least
// squares; infinity for the trivial loss. It solves E[psi'(r)]^2 / E[psi(r)^2] = 0.95 for
// r ~ N(0, 1), psi(r) = rho'(r^2) r; the test of this file integrates.
constexpr double LossTuningConstant(LossType type) {
  switch (type) {
    case LossType::kTrivial:
      break;
    case LossType::kHuber:
      return 1.3450;
    case LossType::kSoftLOne:
      return 1.2871;
    case LossType::kCauchy:
      return 2.3849;
    case LossType::kArctan:
      return 2.5714;
    case LossType::kTukey:
      return 4.6851;
    case LossType::kGemanMcClure:
      return 3.7874;
  }
  return std::numeric_limits<double>::infinity();
}

// Inline: where the type is a constant of the compiler, the switch is gone.
inline double LossRho(LossType type, double s) {
  const double c = LossTuningConstant(type);
  const double c2 = c * c;
  switch (type) {
    case LossType::kTrivial:
      break;
    case LossType::kHuber:
      return s <= c2 ? s : 2.0 * c * std::sqrt(s) - c2;
    case LossType::kSoftLOne:
      return 2.0 * c2 * (std::sqrt(1.0 + s / c2) - 1.0);
    case LossType::kCauchy:
      return c2 * std::log1p(s / c2);
    case LossType::kArctan:
      return c2 * std::atan(s / c2);
    case LossType::kTukey: {
      const double u = s < c2 ? 1.0 - s / c2 : 0.0;
      return c2 / 3.0 * (1.0 - u * u * u);
    }
    case LossType::kGemanMcClure:
      return s / (1.0 + s / c2);
  }
  return s;
}

// rho'(s) and rho''(s).
struct LossSlopes {
  double first, second;  // By s.
};
inline LossSlopes LossSlopesAt(LossType type, double s) {
  const double c = LossTuningConstant(type);
  const double inverse = 1.0 / (c * c);  // 0 for the trivial loss.
  switch (type) {
    case LossType::kTrivial:
      break;
    case LossType::kHuber: {
      if (s <= c * c) break;
      const double slope = c / std::sqrt(s);
      return {slope, -0.5 * slope / s};
    }
    case LossType::kSoftLOne: {
      const double u = 1.0 / (1.0 + s * inverse);
      const double root = std::sqrt(u);
      return {root, -0.5 * inverse * root * u};
    }
    case LossType::kCauchy: {
      const double u = 1.0 / (1.0 + s * inverse);
      return {u, -inverse * u * u};
    }
    case LossType::kArctan: {
      const double u = 1.0 / (1.0 + s * s * inverse * inverse);
      return {u, -2.0 * s * inverse * inverse * u * u};
    }
    case LossType::kTukey: {
      const double u = s * inverse < 1.0 ? 1.0 - s * inverse : 0.0;
      return {u * u, -2.0 * inverse * u};
    }
    case LossType::kGemanMcClure: {
      const double u = 1.0 / (1.0 + s * inverse);
      return {u * u, -2.0 * inverse * u * u * u};
    }
  }
  return {1.0, 0.0};
}

// rho(s) and its derivative.
struct LossValue {
  double rho, rho_prime;  // At s; rho_prime by s.
};
// Both, at s.
inline LossValue EvaluateLoss(LossType type, double s) {
  return {LossRho(type, s), LossSlopesAt(type, s).first};
}

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_ROBUST_LOSS_H_
