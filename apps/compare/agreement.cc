#include "apps/compare/agreement.h"

#include <algorithm>

#include "apps/compare/summary.h"

namespace circline::apps {
namespace {

bool SameLoss(const SolverKey& a, const SolverKey& b) {
  return a.loss == b.loss && a.scale_px == b.scale_px;
}

}  // namespace

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
      angles_[Slot(i, j)].push_back(static_cast<float>(AngleWithoutSenseDeg(
          a.hypotheses.front().rotation.col(2), b.hypotheses.front().rotation.col(2))));
    }
  }
}

std::optional<double> Agreement::MedianDeg(std::size_t i, std::size_t j) const {
  const std::vector<float>& angles = At(i, j);
  if (angles.empty()) return std::nullopt;
  return Median({angles.begin(), angles.end()});
}

}  // namespace circline::apps
