#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "apps/common/svg_plot.h"
#include "apps/common/text.h"
#include "apps/simulate/simulate.h"

namespace circline::apps {
namespace {

constexpr int kPanelWidth = 560, kPanelHeight = 450, kHeading = 36, kPanels = 4;

struct Panel {
  const char* title;
  double SimulationRow::*error;
  double SimulationRow::*bound;
};
constexpr std::array<Panel, kPanels> kPanelList = {
    {{"Rotation axis: mean error", &SimulationRow::axis_mean_rad,
      &SimulationRow::bound_axis_mean_rad},
     {"Rotation axis: standard deviation", &SimulationRow::axis_std_rad,
      &SimulationRow::bound_axis_std_rad},
     {"Rotation angle: mean error", &SimulationRow::angle_mean_rad,
      &SimulationRow::bound_angle_mean_rad},
     {"Rotation angle: standard deviation", &SimulationRow::angle_std_rad,
      &SimulationRow::bound_angle_std_rad}}};

PlotSeries MakeSeries(const std::vector<SimulationRow>& rows, double outlier_ratio,
                      const Method& method, double SimulationRow::*value) {
  PlotSeries series;
  for (const SimulationRow& row : rows) {
    if (row.method == &method && row.outlier_ratio == outlier_ratio)
      series.points.emplace_back(row.noise_px, row.*value);
  }
  std::stable_sort(series.points.begin(), series.points.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  return series;
}

Plot MakePlot(const std::vector<SimulationRow>& rows, double outlier_ratio, const Panel& panel) {
  Plot plot;
  plot.title = panel.title;
  plot.x_label = "noise, px";
  plot.y_label = "rad";
  for (std::size_t m = 0; m < Methods().size(); ++m) {
    const Method& method = Methods()[m];
    PlotSeries errors = MakeSeries(rows, outlier_ratio, method, panel.error);
    errors.name = method.name;
    errors.color = SeriesColor(m);
    plot.series.push_back(errors);
    if (method.stage != SolverStage::kRefined) continue;  // Its bound is that of the refined one.
    PlotSeries bound = MakeSeries(rows, outlier_ratio, method, panel.bound);
    bound.name = std::string("bound of ") + method.solver;
    bound.color = "#222";
    bound.dashed = true;
    plot.series.push_back(bound);
  }
  double highest_x = 0.0, highest_y = 0.0;
  for (const PlotSeries& series : plot.series) {
    for (const auto& [x, y] : series.points) {
      highest_x = std::max(highest_x, x);
      if (std::isfinite(y)) highest_y = std::max(highest_y, y);
    }
  }
  if (highest_x > 0.0) plot.x_max = highest_x;
  if (highest_y > 0.0) plot.y_max = 1.05 * highest_y;
  return plot;
}

}  // namespace

std::string RenderSimulation(const std::vector<SimulationRow>& rows) {
  std::vector<double> ratios;
  for (const SimulationRow& row : rows) {
    if (std::find(ratios.begin(), ratios.end(), row.outlier_ratio) == ratios.end())
      ratios.push_back(row.outlier_ratio);
  }
  constexpr int kColumns = 2;
  constexpr int kBlock = kHeading + kPanels / kColumns * kPanelHeight;
  const int width = kColumns * kPanelWidth, height = kBlock * static_cast<int>(ratios.size());
  std::ostringstream svg;
  svg << "<svg xmlns='http://www.w3.org/2000/svg' width='" << width << "' height='" << height
      << "' viewBox='0 0 " << width << " " << height
      << "' color='#222'><rect width='100%' height='100%' fill='#fff'/>\n";
  for (std::size_t i = 0; i < ratios.size(); ++i) {
    const int top = kBlock * static_cast<int>(i);
    svg << "<text font-family='system-ui,sans-serif' font-size='16' text-anchor='middle' x='"
        << width / 2 << "' y='" << top + 24 << "'>"
        << (ratios[i] > 0.0
                ? FormatShort(100.0 * ratios[i]) + " % of every feature's points are outliers"
                : "No outliers")
        << "</text>\n";
    for (int p = 0; p < kPanels; ++p) {
      svg << "<svg x='" << p % kColumns * kPanelWidth << "' y='"
          << top + kHeading + p / kColumns * kPanelHeight << "' width='" << kPanelWidth
          << "' height='" << kPanelHeight << "'>"
          << RenderSvg(MakePlot(rows, ratios[i], kPanelList[static_cast<std::size_t>(p)]))
          << "</svg>\n";
    }
  }
  svg << "</svg>\n";
  return svg.str();
}

}  // namespace circline::apps
