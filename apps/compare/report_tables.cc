#include <algorithm>
#include <set>

#include "apps/common/report_page.h"
#include "apps/common/text.h"
#include "apps/compare/report_parts.h"
#include "apps/compare/sweep.h"

namespace circline::apps {
namespace {

constexpr double kRounding = 1e-6;  // Degrees.

// A name that may go on in the next line after an underscore.
std::string Breakable(const std::string& name) {
  std::string html;
  for (const char c : name) html += c == '_' ? "_<wbr>" : EscapeHtml(std::string(1, c));
  return html;
}

// The cell's number: the median error, or the residual and the share of inliers.
std::string SweepText(const SummaryRow* row) {
  if (row == nullptr || row->ok == 0) return "-";
  if (!row->headline_errors.empty()) return FormatShort(Median(row->headline_errors)) + " \u00b0";
  return FormatShort(Median(row->rms_px)) + " px, " +
         FormatFixed(100.0 * Mean(row->inlier_shares), 0) + " %";
}

}  // namespace

std::string SummaryTable(const Summary& summary) {
  std::vector<SummaryColumn> columns = summary.Columns();
  columns.push_back(
      {"time ms", "median time of an answer", false, [](const SummaryRow& row) {
         return FormatShort(1e-3 * Median({row.microseconds.begin(), row.microseconds.end()}));
       }});
  std::string html = "<div class='scroll'><table class='sortable named brief'><thead><tr>";
  const std::set<const SummaryRow*> shown = RowsToShow(summary);
  int num_rest = 0;
  for (const SummaryColumn& column : columns) {
    html += std::string("<th") + (column.left ? " class='l'" : "") + " title='" +
            EscapeHtml(column.explanation) + "'>" + EscapeHtml(column.title) + "</th>";
  }
  html += "</tr></thead><tbody>";
  std::vector<std::string> refused;
  for (const SummaryRow* row : summary.Ranked()) {
    if (row->refused == row->images) {
      AddOnce(row->key.solver, &refused);
      continue;
    }
    const bool rest = shown.count(row) == 0;
    num_rest += rest ? 1 : 0;
    html += rest ? "<tr class='rest'>" : "<tr>";
    for (const SummaryColumn& column : columns) {
      const std::string text = column.text(*row);
      html += column.left ? "<td class='l'>" + Breakable(text) + "</td>" : CellHtml(text);
    }
    html += "</tr>";
  }
  html += "</tbody></table></div>";
  if (num_rest > 0) {
    html += "<p class='choose'><button class='rest'>show every loss and scale (" +
            std::to_string(num_rest) + " more rows)</button></p>";
  }
  if (refused.empty()) return html;
  return html + "<p class='lead'>Refused every image: " + EscapeHtml(JoinList(refused, ", ")) +
         ".</p>";
}

std::string AgreementTable(const Agreement& agreement) {
  std::vector<std::size_t> used;  // Solvers that answered together with some other.
  const std::size_t count = agreement.keys().size();
  for (std::size_t i = 0; i < count; ++i) {
    for (std::size_t j = 0; j < count; ++j) {
      if (i == j || !agreement.MedianDeg(i, j)) continue;
      used.push_back(i);
      break;
    }
  }
  if (used.empty()) return "";
  std::string html = "<div class='scroll'><table class='matrix'><thead><tr><th></th>";
  for (const std::size_t i : used) {
    const SolverKey& key = agreement.keys()[i];
    html += "<th>" + Breakable(key.solver) + "<br>" +
            (key.stage == "refined" ? "refined" : "closed") + "</th>";
  }
  html += "</tr></thead><tbody>";
  for (const std::size_t i : used) {
    html += "<tr><th class='l'>" + Breakable(agreement.keys()[i].Name()) + "</th>";
    for (const std::size_t j : used) {
      std::optional<double> median = i == j ? std::nullopt : agreement.MedianDeg(i, j);
      if (median && *median < kRounding) median = 0.0;
      html += "<td" +
              (median ? " title='" + std::to_string(agreement.Count(i, j)) + " images'"
                      : std::string()) +
              ">" +
              (i == j   ? ""
               : median ? FormatShort(*median, 2)
                        : "-") +
              "</td>";
    }
    html += "</tr>";
  }
  return html + "</tbody></table></div>";
}

std::string SweepTable(const Summary& summary) {
  const std::vector<LossPoint> points = LossPoints(summary);
  if (points.size() < 2) return "";
  const std::vector<std::string> solvers = RefinedSolvers(summary);
  std::string html =
      "<div class='scroll'><table class='sortable'><thead><tr><th class='l'>loss</th>"
      "<th>scale px</th>";
  std::vector<const SummaryRow*> best;
  for (const std::string& solver : solvers) {
    html += "<th>" + EscapeHtml(solver) + "</th>";
    best.push_back(BestRow(summary, solver));
  }
  html += "</tr></thead><tbody>";
  for (const LossPoint& point : points) {
    html += "<tr>" + CellHtml(point.loss, "l") +
            CellHtml(point.scale_px > 0.0 ? FormatPlain(point.scale_px) : "auto");
    for (std::size_t i = 0; i < solvers.size(); ++i) {
      const SummaryRow* row = FindRefined(summary, solvers[i], point);
      html += CellHtml(SweepText(row), row != nullptr && row == best[i] ? "best" : "");
    }
    html += "</tr>";
  }
  return html + "</tbody></table></div>";
}

}  // namespace circline::apps
