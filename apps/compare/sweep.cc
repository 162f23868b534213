#include "apps/compare/sweep.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "apps/common/text.h"

namespace circline::apps {
namespace {

// The smaller, the better.
std::array<double, 2> Badness(const SummaryRow& row) {
  if (!row.headline_errors.empty()) {
    return {Median(row.headline_errors), Mean(row.headline_errors)};
  }
  // Worse than any row with a truth, whose errors are below 180 degrees.
  return {1e3 - std::round(100.0 * Mean(row.inlier_shares)), Median(row.rms_px)};
}

}  // namespace

std::vector<LossPoint> LossPoints(const Summary& summary) {
  std::vector<LossPoint> points;
  for (const SummaryRow& row : summary.rows()) {
    if (!row.key.refined()) continue;
    const bool known = std::any_of(points.begin(), points.end(), [&row](const LossPoint& p) {
      return p.loss == row.key.loss && p.scale_px == row.key.scale_px;
    });
    if (!known) points.push_back({row.key.loss, row.key.scale_px});
  }
  return points;
}

std::vector<std::string> RefinedSolvers(const Summary& summary) {
  std::vector<std::string> names;
  for (const SummaryRow& row : summary.rows()) {
    if (row.key.refined() && row.ok > 0) AddOnce(row.key.solver, &names);
  }
  return names;
}

const SummaryRow* FindRefined(const Summary& summary, const std::string& solver,
                              const LossPoint& point) {
  for (const SummaryRow& row : summary.rows()) {
    if (row.key == SolverKey{solver, "refined", point.loss, point.scale_px}) return &row;
  }
  return nullptr;
}

const SummaryRow* BestRow(const Summary& summary, const std::string& solver) {
  const auto counts = [&solver](const SummaryRow& row) {
    return row.key.refined() && row.ok > 0 && (solver.empty() || row.key.solver == solver);
  };
  int most = 0;
  for (const SummaryRow& row : summary.rows()) {
    if (counts(row)) most = std::max(most, row.ok);
  }
  const SummaryRow* best = nullptr;
  for (const SummaryRow& row : summary.rows()) {
    if (!counts(row) || 10 * row.ok < 9 * most) continue;
    if (best == nullptr || Badness(row) < Badness(*best)) best = &row;
  }
  return best;
}

std::set<const SummaryRow*> RowsToShow(const Summary& summary) {
  const bool is_sweep = LossPoints(summary).size() > 1;
  std::set<const SummaryRow*> rows;
  for (const SummaryRow& row : summary.rows()) {
    if (!is_sweep || !row.key.refined()) rows.insert(&row);
  }
  if (!is_sweep) return rows;
  for (const std::string& solver : RefinedSolvers(summary)) rows.insert(BestRow(summary, solver));
  return rows;
}

std::string DescribeRow(const SummaryRow& row) {
  const std::string images =
      std::to_string(row.ok) + " of " + std::to_string(row.images) + " images";
  if (!row.headline_errors.empty()) {
    return row.key.Name() + ": median error " + FormatShort(Median(row.headline_errors)) +
           " degrees in " + images;
  }
  return row.key.Name() + ": " + FormatFixed(100.0 * Mean(row.inlier_shares), 0) +
         " % inliers, median residual " + FormatShort(Median(row.rms_px)) + " px in " + images;
}

}  // namespace circline::apps
