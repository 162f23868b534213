#include "apps/compare/summary.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>
#include <numeric>
#include <sstream>

#include "apps/common/text.h"

namespace circline::apps {
namespace {

constexpr double kTieDeg = 1e-3;  // Hypotheses this equally far from the truth are equally good.

// Index of the hypothesis nearest to the truth, or -1 where there is none to compare with.
int NearestHypothesis(const std::vector<HypothesisRecord>& hypotheses) {
  int nearest = -1;
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < hypotheses.size(); ++i) {
    const auto error = hypotheses[i].errors.Headline();
    if (!error) return -1;
    if (nearest < 0 || *error < smallest - kTieDeg) {
      nearest = static_cast<int>(i);
      smallest = *error;
    }
  }
  return nearest;
}

void AddErrors(const std::vector<HypothesisRecord>& hypotheses, SummaryRow* row) {
  const PoseErrors& best = hypotheses.front().errors;
  if (best.rotation_deg) row->rotation_errors.push_back(*best.rotation_deg);
  if (best.normal_deg) row->normal_errors.push_back(*best.normal_deg);
  double worst = -1.0;
  for (const auto& [id, error] : best.directions_deg) {
    row->direction_errors.push_back(error);
    worst = std::max(worst, error);
  }
  if (worst >= 0.0) row->worst_direction_errors.push_back(worst);
  if (best.Headline()) row->headline_errors.push_back(*best.Headline());
  const int nearest = NearestHypothesis(hypotheses);
  if (nearest < 0) return;
  ++row->with_truth;
  if (hypotheses.size() > 1) ++row->ambiguous;
  if (nearest == 0) ++row->best_is_better;
  double normal = std::numeric_limits<double>::infinity();
  for (const HypothesisRecord& hypothesis : hypotheses) {
    normal = std::min(normal, hypothesis.errors.normal_deg.value_or(normal));
  }
  if (std::isfinite(normal)) row->better_normal_errors.push_back(normal);
}

void AddSolver(const SolverRecord& solver, SummaryRow* row) {
  ++row->images;
  if (!solver.HasAnswer()) {
    ++(solver.status == "refused" ? row->refused : row->failed);
    return;
  }
  ++row->ok;
  // Of answers only: a refusal takes next to no time.
  if (std::isfinite(solver.microseconds)) {
    row->microseconds.push_back(static_cast<float>(solver.microseconds));
  }
  const HypothesisRecord& best = solver.hypotheses.front();
  if (std::isfinite(best.rms_px)) row->rms_px.push_back(best.rms_px);
  if (best.num_observations > 0) {
    row->inlier_shares.push_back(static_cast<double>(best.num_inliers) / best.num_observations);
  }
  AddErrors(solver.hypotheses, row);
}

double BetterShare(const SummaryRow& row) {
  return row.with_truth == 0 ? kUnknown : static_cast<double>(row.best_is_better) / row.with_truth;
}

// Numbers of a CSV as JSON writes them: shortest that read back the same; empty where unknown.
std::string CsvNumber(double value) {
  return std::isfinite(value) ? nlohmann::json(value).dump() : std::string();
}

// Columns padded to the same width.
std::string Align(const std::vector<SummaryColumn>& columns,
                  const std::vector<std::vector<std::string>>& lines) {
  std::vector<std::size_t> widths(columns.size(), 0);
  for (const auto& line : lines) {
    for (std::size_t i = 0; i < line.size(); ++i) widths[i] = std::max(widths[i], line[i].size());
  }
  std::string text;
  for (const auto& line : lines) {
    std::string row;
    for (std::size_t i = 0; i < line.size(); ++i) {
      const std::string pad(widths[i] - line[i].size(), ' ');
      row += (i == 0 ? "" : "  ") + (columns[i].left ? line[i] + pad : pad + line[i]);
    }
    row.erase(row.find_last_not_of(' ') + 1);
    text += row + "\n";
  }
  return text;
}

// A column of the median, or what else is made of one of the lists of a row.
SummaryColumn ListColumn(std::string title, std::string explanation,
                         std::vector<double> SummaryRow::*list,
                         double (*reduce)(const std::vector<double>&)) {
  return {std::move(title), std::move(explanation), false,
          [list, reduce](const SummaryRow& row) { return FormatShort(reduce(row.*list)); }};
}

double NinetiethPercentile(const std::vector<double>& values) { return Quantile(values, 0.9); }

std::vector<SummaryColumn> AllColumns() {
  using Row = SummaryRow;
  const auto count = [](int Row::*field) {
    return [field](const Row& row) { return std::to_string(row.*field); };
  };
  return {
      {"solver", "", true, [](const Row& row) { return row.key.solver; }},
      {"stage", "", true, [](const Row& row) { return row.key.stage; }},
      {"loss", "", true, [](const Row& row) { return row.key.refined() ? row.key.loss : "-"; }},
      {"scale", "standard deviation of a point, pixels", true,
       [](const Row& row) { return row.key.ScaleText(); }},
      {"ok", "images with an answer", false, count(&Row::ok)},
      {"refused", "images whose evidence does not suffice", false, count(&Row::refused)},
      {"failed", "images where the numerics did not get there", false, count(&Row::failed)},
      ListColumn("rotation deg", "median rotation error of the best hypothesis",
                 &Row::rotation_errors, Median),
      ListColumn("mean", "mean rotation error", &Row::rotation_errors, Mean),
      ListColumn("90 %", "90 % of the rotation errors are smaller", &Row::rotation_errors,
                 NinetiethPercentile),
      ListColumn("normal deg", "median error of the plane's normal, best hypothesis",
                 &Row::normal_errors, Median),
      ListColumn("better one", "the same for the hypothesis that is nearest to the truth",
                 &Row::better_normal_errors, Median),
      ListColumn("direction deg", "median error of the pencils' directions", &Row::direction_errors,
                 Median),
      {"best right", "share of images in which the best hypothesis is the one nearest to the truth",
       false,
       [](const Row& row) {
         const double share = BetterShare(row);
         return std::isfinite(share) ? FormatFixed(100.0 * share, 0) + " %" : "-";
       }},
      ListColumn("rms px", "median of the root mean square residual", &Row::rms_px, Median),
  };
}

}  // namespace

double Quantile(std::vector<double> values, double q) {
  if (values.empty()) return kUnknown;
  std::sort(values.begin(), values.end());
  const double position = q * static_cast<double>(values.size() - 1);
  const std::size_t low = static_cast<std::size_t>(position);
  const std::size_t high = std::min(low + 1, values.size() - 1);
  return values[low] + (position - static_cast<double>(low)) * (values[high] - values[low]);
}

double Median(const std::vector<double>& values) { return Quantile(values, 0.5); }

double Mean(const std::vector<double>& values) {
  if (values.empty()) return kUnknown;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

void Summary::Add(const ImageRecord& record) {
  ++num_images_;
  if (!record.error.empty()) ++num_unreadable_;
  for (std::size_t i = 0; i < record.solvers.size(); ++i) {
    if (i >= rows_.size()) {  // Every image runs the same solvers in the same order.
      rows_.emplace_back();
      rows_.back().key = record.solvers[i].key;
    }
    AddSolver(record.solvers[i], &rows_[i]);
  }
}

std::vector<const SummaryRow*> Summary::Ranked() const {
  std::vector<const SummaryRow*> ranked;
  for (const SummaryRow& row : rows_) ranked.push_back(&row);
  const auto key = [](const SummaryRow* row) {
    const auto or_last = [](double value) {
      return std::isfinite(value) ? value : std::numeric_limits<double>::infinity();
    };
    const double answers = row->ok == 0 ? 2.0 : 2 * row->ok < row->images ? 1.0 : 0.0;
    return std::array<double, 3>{answers, or_last(Median(row->headline_errors)),
                                 or_last(Median(row->rms_px))};
  };
  std::stable_sort(ranked.begin(), ranked.end(),
                   [&key](const SummaryRow* a, const SummaryRow* b) { return key(a) < key(b); });
  return ranked;
}

std::string Summary::Csv() const {
  std::ostringstream csv;
  csv << "solver,stage,loss,loss_scale_px,images,ok,refused,failed,median_rotation_error_deg,"
         "mean_rotation_error_deg,p90_rotation_error_deg,median_normal_error_deg,"
         "median_better_normal_error_deg,median_direction_error_deg,best_is_better_share,"
         "ambiguous,median_rms_px\n";
  for (const SummaryRow& row : rows_) {
    const SolverKey& key = row.key;
    csv << key.solver << "," << key.stage << "," << key.loss << ","
        << (!key.refined()       ? ""
            : key.scale_px > 0.0 ? CsvNumber(key.scale_px)
                                 : "auto")
        << "," << row.images << "," << row.ok << "," << row.refused << "," << row.failed << ","
        << CsvNumber(Median(row.rotation_errors)) << "," << CsvNumber(Mean(row.rotation_errors))
        << "," << CsvNumber(Quantile(row.rotation_errors, 0.9)) << ","
        << CsvNumber(Median(row.normal_errors)) << ","
        << CsvNumber(Median(row.better_normal_errors)) << ","
        << CsvNumber(Median(row.direction_errors)) << "," << CsvNumber(BetterShare(row)) << ","
        << row.ambiguous << "," << CsvNumber(Median(row.rms_px)) << "\n";
  }
  return csv.str();
}

std::vector<SummaryColumn> Summary::Columns() const {
  std::vector<SummaryColumn> columns;
  for (SummaryColumn& column : AllColumns()) {
    const bool says_something =
        std::any_of(rows_.begin(), rows_.end(),
                    [&column](const SummaryRow& row) { return column.text(row) != "-"; });
    if (says_something) columns.push_back(std::move(column));
  }
  return columns;
}

std::string Summary::Table() const {
  if (rows_.empty()) return "";
  const std::vector<SummaryColumn> columns = Columns();
  std::vector<std::vector<std::string>> lines(1);
  for (const SummaryColumn& column : columns) lines[0].push_back(column.title);
  // Solvers that refused every image need no row, only their names.
  std::vector<std::string> refused;
  for (const SummaryRow* row : Ranked()) {
    if (row->refused == row->images) {
      AddOnce(row->key.solver, &refused);
      continue;
    }
    std::vector<std::string> line;
    for (const SummaryColumn& column : columns) line.push_back(column.text(*row));
    lines.push_back(std::move(line));
  }
  std::string table = lines.size() > 1 ? Align(columns, lines) : "";
  if (refused.empty()) return table;
  return table + "refused every image (the report says why): " + JoinList(refused, ", ") + "\n";
}

}  // namespace circline::apps
