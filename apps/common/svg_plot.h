// Line plots as inline SVG: no script, no font and no file from elsewhere.
#ifndef CIRCLINE_APPS_COMMON_SVG_PLOT_H_
#define CIRCLINE_APPS_COMMON_SVG_PLOT_H_

#include <string>
#include <utility>
#include <vector>

namespace circline::apps {

struct PlotSeries {
  std::string name;
  std::string color;                              // CSS.
  bool dashed = false, dots = false;              // Dots mark the points.
  std::vector<std::pair<double, double>> points;  // In drawing order; not finite = a gap.
};

struct Plot {
  std::string title, x_label, y_label;
  double x_min = 0.0, x_max = 1.0, y_min = 0.0, y_max = 1.0;
  bool log_x = false, log_y = false;  // Then x_min > 0, y_min > 0.
  bool percent_y = false;
  int width = 560, height = 360;  // Of the plotting area with its labels; the legend stands below.
  std::vector<PlotSeries> series;
};

// An <svg> element. Lines and letters take the page's text colour (currentColor).
std::string RenderSvg(const Plot& plot);

// Round values of an axis; on a logarithmic one 1, 2 and 5 times powers of ten.
std::vector<double> PlotTicks(bool log, double low, double high);

// Colours that stay apart for most eyes, repeated after ten.
std::string SeriesColor(std::size_t index);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_SVG_PLOT_H_
