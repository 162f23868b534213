#include "circline/estimators/robust_loss.h"

#include <array>

namespace circline {
namespace {

struct Loss {
  LossType type;
  const char* name;
};

constexpr std::array<Loss, 7> kLosses = {{
    {LossType::kTrivial, "trivial"},
    {LossType::kHuber, "huber"},
    {LossType::kSoftLOne, "soft_l_one"},
    {LossType::kCauchy, "cauchy"},
    {LossType::kArctan, "arctan"},
    {LossType::kTukey, "tukey"},
    {LossType::kGemanMcClure, "geman_mcclure"},
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

}  // namespace circline
