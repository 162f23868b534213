#include "apps/compare/selection.h"

#include <algorithm>

namespace circline::apps {

ImageScore ScoreOf(const ImageRecord& record) {
  ImageScore score;
  if (!record.error.empty()) {
    score.fate = Fate::kUnreadable;
    return score;
  }
  const SolverRecord* shown = AnswerToShow(record.solvers);
  if (shown == nullptr) return score;
  const HypothesisRecord& best = shown->hypotheses.front();
  const std::optional<double> error = best.errors.Headline();
  score.fate = Fate::kAnswered;
  score.has_truth = error.has_value();
  score.value = static_cast<float>(error.value_or(best.rms_px));
  return score;
}

std::vector<ShownImage> SelectImages(const std::vector<ImageScore>& scores, std::size_t limit) {
  std::vector<ShownImage> shown;
  if (scores.size() <= limit) {
    for (std::size_t i = 0; i < scores.size(); ++i) shown.push_back({i, ""});
    return shown;
  }
  std::vector<std::size_t> answered, others;
  for (std::size_t i = 0; i < scores.size(); ++i) {
    (scores[i].fate == Fate::kAnswered ? answered : others).push_back(i);
  }
  // Worst first: those with a truth before those without, whose residual is another measure.
  std::stable_sort(answered.begin(), answered.end(), [&](std::size_t a, std::size_t b) {
    if (scores[a].has_truth != scores[b].has_truth) return scores[a].has_truth;
    return scores[a].value > scores[b].value;
  });
  const std::size_t refused =
      std::min(others.size(), std::max(limit / 3, limit - std::min(limit, answered.size())));
  const std::size_t middle = std::min(answered.size(), limit / 3);
  const std::size_t worst = std::min(answered.size() - middle, limit - refused - middle);
  for (std::size_t i = 0; i < worst; ++i) shown.push_back({answered[i], "worst"});
  const std::size_t first =
      std::max(worst, answered.size() / 2 - std::min(answered.size() / 2, middle / 2));
  const std::size_t begin = std::min(first, answered.size() - middle);
  for (std::size_t i = begin; i < begin + middle; ++i) shown.push_back({answered[i], "median"});
  for (std::size_t i = 0; i < refused; ++i) shown.push_back({others[i], "refused"});
  return shown;
}

}  // namespace circline::apps
