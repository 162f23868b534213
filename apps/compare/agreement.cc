#include "apps/compare/agreement.h"

#include <algorithm>

#include "apps/compare/summary.h"

namespace circline::apps {
namespace {

constexpr std::size_t kMaxKept = 2048;

bool SameLoss(const SolverKey& a, const SolverKey& b) {
  return a.loss == b.loss && a.scale_px == b.scale_px;
}

}  // namespace

void Agreement::Angles::Add(double angle) {
  if (seen++ % stride != 0) return;
  kept.push_back(static_cast<float>(angle));
  if (kept.size() < kMaxKept) return;
  for (std::size_t i = 0; 2 * i < kept.size(); ++i) kept[i] = kept[2 * i];
  kept.resize(kept.size() / 2);
  stride *= 2;
}

std::size_t Agreement::Slot(std::size_t i, std::size_t j) {
  const std::size_t high = std::max(i, j), low = std::min(i, j);
  return high * (high - 1) / 2 + low;
}

void Agreement::Add(const ImageRecord& record) {
  if (keys_.empty()) {
    const auto first = std::find_if(record.solvers.begin(), record.solvers.end(),
                                    [](const SolverRecord& s) { return s.key.refined(); });
    for (std::size_t i = 0; i < record.solvers.size(); ++i) {
      const SolverKey& key = record.solvers[i].key;
      if (key.refined() && !SameLoss(key, first->key)) continue;
      keys_.push_back(key);
      positions_.push_back(i);
    }
    angles_.resize(keys_.size() * (keys_.size() + 1) / 2);
  }
  for (std::size_t i = 0; i < positions_.size(); ++i) {
    if (positions_[i] >= record.solvers.size()) return;  // A photo that could not be read.
    const SolverRecord& a = record.solvers[positions_[i]];
    if (!a.HasAnswer()) continue;
    for (std::size_t j = 0; j < i; ++j) {
      const SolverRecord& b = record.solvers[positions_[j]];
      if (!b.HasAnswer()) continue;
      angles_[Slot(i, j)].Add(AngleWithoutSenseDeg(a.hypotheses.front().rotation.col(2),
                                                   b.hypotheses.front().rotation.col(2)));
    }
  }
}

std::optional<double> Agreement::MedianDeg(std::size_t i, std::size_t j) const {
  const std::vector<float>& kept = At(i, j).kept;
  if (kept.empty()) return std::nullopt;
  return Median({kept.begin(), kept.end()});
}

}  // namespace circline::apps
