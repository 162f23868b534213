// Bars and box plots that lie: a row for each name, as inline SVG.
#ifndef CIRCLINE_APPS_COMMON_SVG_ROWS_H_
#define CIRCLINE_APPS_COMMON_SVG_ROWS_H_

#include <array>
#include <string>
#include <vector>

namespace circline::apps {

struct SvgRow {
  std::string name, color;  // CSS.
  // Ends of the whiskers, quartiles and median in order: q[0] <= ... <= q[4].
  std::array<double, 5> quantiles{};
  std::string label;  // At the end of the row.
};

struct RowsPlot {
  std::string title, x_label;
  bool bars = false;  // From the left to the median, instead of boxes.
  bool log_x = true;
  std::vector<SvgRow> rows;
};

// Empty if there is no row.
std::string RenderRows(const RowsPlot& plot);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_SVG_ROWS_H_
