#include "circline/estimators/robust_loss.h"

#include <algorithm>
#include <array>

namespace circline {
namespace {

// In the order of LossType.
constexpr std::array<const char*, 7> kLossNames = {"trivial", "huber", "soft_l_one",   "cauchy",
                                                   "arctan",  "tukey", "geman_mcclure"};

}  // namespace

const char* LossName(LossType type) { return kLossNames[static_cast<std::size_t>(type)]; }

bool LossFromName(const std::string& name, LossType* type) {
  const auto found = std::find(kLossNames.begin(), kLossNames.end(), name);
  if (found == kLossNames.end()) return false;
  *type = static_cast<LossType>(found - kLossNames.begin());
  return true;
}

std::vector<std::string> LossNames() { return {kLossNames.begin(), kLossNames.end()}; }

}  // namespace circline
