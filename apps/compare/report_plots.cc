#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <vector>

#include "apps/common/svg_plot.h"
#include "apps/common/text.h"
#include "apps/compare/report_parts.h"
#include "apps/compare/sweep.h"

namespace circline::apps {
namespace {

constexpr std::size_t kMaxSteps = 300;  // Of one curve.

// A row of the summary as the plots show it.
struct PlotRow {
  const SummaryRow* row;
  std::string name, color;
};

// Ranked; only rows with an answer, and of the losses of a sweep only each solver's best.
std::vector<PlotRow> PlotRows(const Summary& summary) {
  const bool is_sweep = LossPoints(summary).size() > 1;
  const std::set<const SummaryRow*> shown = RowsToShow(summary);
  std::map<std::string, std::size_t> colors;
  std::vector<PlotRow> rows;
  for (const SummaryRow* row : summary.Ranked()) {
    const SolverKey& key = row->key;
    if (row->ok == 0 || shown.count(row) == 0) continue;
    const std::string name = is_sweep || !key.refined() ? key.Name() : key.solver + " refined";
    rows.push_back(
        {row, name, SeriesColor(colors.emplace(key.solver, colors.size()).first->second)});
  }
  return rows;
}

std::string InDiv(const std::string& svg) { return svg.empty() ? "" : "<div>" + svg + "</div>"; }

// Share of images within x, as steps; images without an answer never get there.
PlotSeries CumulativeCurve(const SummaryRow& row, std::vector<double> errors, double x_min,
                           double x_max) {
  PlotSeries series;
  std::sort(errors.begin(), errors.end());
  double share = 0.0;
  const std::size_t stride = 1 + errors.size() / kMaxSteps;
  series.points.emplace_back(x_min, 0.0);
  for (std::size_t i = stride - 1; i < errors.size(); i += stride) {
    const double x = std::clamp(errors[i], x_min, x_max);
    series.points.emplace_back(x, share);
    share = static_cast<double>(i + 1) / row.images;
    series.points.emplace_back(x, share);
  }
  series.points.emplace_back(x_max, share);
  return series;
}

std::string CumulativePlot(const Summary& summary, const std::string& title, const char* unit,
                           std::vector<double> SummaryRow::*errors) {
  Plot plot;
  plot.title = title;
  plot.x_label = unit;
  plot.y_label = "share of images";
  plot.log_x = plot.percent_y = true;
  double low = 10.0, high = 1.0;
  const std::vector<PlotRow> rows = PlotRows(summary);
  for (const PlotRow& row : rows) {
    for (const double error : row.row->*errors) {
      low = std::min(low, error);
      high = std::max(high, error);
    }
  }
  plot.x_min = std::clamp(std::pow(10.0, std::floor(std::log10(std::max(low, 1e-6)))), 1e-3, 1.0);
  plot.x_max = std::clamp(high * 1.05, 2.0, 180.0);
  for (const PlotRow& row : rows) {
    if ((row.row->*errors).empty()) continue;
    PlotSeries series = CumulativeCurve(*row.row, row.row->*errors, plot.x_min, plot.x_max);
    series.name = row.name;
    series.color = row.color;
    series.dashed = row.row->key.stage != "refined";
    plot.series.push_back(std::move(series));
  }
  if (plot.series.empty()) return "";
  return InDiv(RenderSvg(plot));
}

// One measure of the sweep of one solver.
struct SweepMeasure {
  std::string label;
  bool log_y;
  double (*value)(const SummaryRow&);
};

std::string SweepPlot(const Summary& summary, const std::string& solver,
                      const SweepMeasure& measure) {
  Plot plot;
  plot.title = solver;
  plot.x_label = "loss scale, px";
  plot.y_label = measure.label;
  plot.log_x = true;
  plot.log_y = measure.log_y;
  std::map<std::string, PlotSeries> by_loss;
  std::vector<std::pair<std::string, double>> automatic;
  double x_low = 1e30, x_high = 0.0, y_low = 1e30, y_high = 0.0;
  for (const LossPoint& point : LossPoints(summary)) {
    const SummaryRow* row = FindRefined(summary, solver, point);
    const double y = row == nullptr ? kUnknown : measure.value(*row);
    if (!std::isfinite(y)) continue;
    y_low = std::min(y_low, y);
    y_high = std::max(y_high, y);
    if (point.scale_px > 0.0) {
      by_loss[point.loss].points.emplace_back(point.scale_px, y);
      x_low = std::min(x_low, point.scale_px);
      x_high = std::max(x_high, point.scale_px);
    } else {
      automatic.emplace_back(point.loss, y);
    }
  }
  if (by_loss.empty() && automatic.empty()) return "";
  if (by_loss.empty()) x_low = x_high = 1.0;
  plot.x_min = x_low / 1.25;
  plot.x_max = x_high * 1.25;
  plot.y_min = measure.log_y ? std::max(y_low, 1e-6) / 1.25 : 0.0;
  plot.y_max = measure.log_y ? std::max(y_high, 1e-6) * 1.25 : std::max(1.0, y_high);
  std::size_t color = 0;
  std::map<std::string, std::string> colors;
  for (const LossPoint& point : LossPoints(summary)) {
    if (colors.emplace(point.loss, SeriesColor(color)).second) ++color;
  }
  for (auto& [loss, series] : by_loss) {
    std::sort(series.points.begin(), series.points.end());
    series.name = loss;
    series.color = colors[loss];
    series.dots = true;
    plot.series.push_back(series);
  }
  for (const auto& [loss, y] : automatic) {
    plot.series.push_back(
        {loss + ", auto", colors[loss], true, false, {{plot.x_min, y}, {plot.x_max, y}}});
  }
  return InDiv(RenderSvg(plot));
}

}  // namespace

std::string CumulativePlots(const Summary& summary) {
  using Row = SummaryRow;
  return CumulativePlot(summary, "Rotation error", "degrees", &Row::rotation_errors) +
         CumulativePlot(summary, "Normal error of the best hypothesis", "degrees",
                        &Row::normal_errors) +
         CumulativePlot(summary, "Error of the worst direction", "degrees",
                        &Row::worst_direction_errors) +
         CumulativePlot(summary, "Residual, root mean square", "pixels", &Row::rms_px);
}

std::string SweepPlots(const Summary& summary) {
  if (LossPoints(summary).size() < 2) return "";
  const bool has_truth =
      std::any_of(summary.rows().begin(), summary.rows().end(),
                  [](const SummaryRow& row) { return !row.headline_errors.empty(); });
  const SweepMeasure error = {"median error, degrees", true,
                              [](const SummaryRow& row) { return Median(row.headline_errors); }};
  const SweepMeasure residual = {"median residual, px", true,
                                 [](const SummaryRow& row) { return Median(row.rms_px); }};
  const SweepMeasure inliers = {"mean share of inliers", false,
                                [](const SummaryRow& row) { return Mean(row.inlier_shares); }};
  std::string html;
  for (const std::string& solver : RefinedSolvers(summary)) {
    html += has_truth ? SweepPlot(summary, solver, error)
                      : SweepPlot(summary, solver, residual) + SweepPlot(summary, solver, inliers);
  }
  return html;
}

}  // namespace circline::apps
