#include "circline/estimators/robust_loss.h"

#include <array>
#include <limits>

namespace circline {
namespace {

struct Loss {
  LossType type;
  const char* name;
  double constant;
};

// The constants solve E[psi'(r)]^2 / E[psi(r)^2] = 0.95 for r ~ N(0, 1), psi(r) = rho'(r^2) r; the
// test of this file integrates them.
constexpr std::array<Loss, 7> kLosses = {{
    {LossType::kTrivial, "trivial", std::numeric_limits<double>::infinity()},
    {LossType::kHuber, "huber", 1.3450},
    {LossType::kSoftLOne, "soft_l_one", 1.2871},
    {LossType::kCauchy, "cauchy", 2.3849},
    {LossType::kArctan, "arctan", 2.5714},
    {LossType::kTukey, "tukey", 4.6851},
    {LossType::kGemanMcClure, "geman_mcclure", 3.7874},
}};

}  // namespace

const char* LossName(LossType type) { return kLosses[static_cast<std::size_t>(type)].name; }

bool LossFromName(const std::string& name, LossType* type) {
  for (const Loss& loss : kLosses) {
    if (name == loss.name) {
      *type = loss.type;
      return true;
    }
  }
  return false;
}

std::vector<std::string> LossNames() {
  std::vector<std::string> names;
  for (const Loss& loss : kLosses) names.emplace_back(loss.name);
  return names;
}

double LossTuningConstant(LossType type) {
  return kLosses[static_cast<std::size_t>(type)].constant;
}

LossValue EvaluateLoss(LossType type, double s) {
  if (type == LossType::kTrivial) return {s, 1.0};
  const double c = LossTuningConstant(type);
  const double c2 = c * c;
  switch (type) {
    case LossType::kTrivial:
      break;
    case LossType::kHuber: {
      if (s <= c2) return {s, 1.0};
      const double r = std::sqrt(s);
      return {2.0 * c * r - c2, c / r};
    }
    case LossType::kSoftLOne: {
      const double root = std::sqrt(1.0 + s / c2);
      return {2.0 * c2 * (root - 1.0), 1.0 / root};
    }
    case LossType::kCauchy:
      return {c2 * std::log1p(s / c2), 1.0 / (1.0 + s / c2)};
    case LossType::kArctan:
      return {c2 * std::atan(s / c2), 1.0 / (1.0 + s * s / (c2 * c2))};
    case LossType::kTukey: {
      if (s > c2) return {c2 / 3.0, 0.0};
      const double u = 1.0 - s / c2;
      return {c2 / 3.0 * (1.0 - u * u * u), u * u};
    }
    case LossType::kGemanMcClure: {
      const double u = 1.0 / (1.0 + s / c2);
      return {s * u, u * u};
    }
  }
  return {s, 1.0};
}

}  // namespace circline
