#include "apps/common/svg_rows.h"

#include <algorithm>
#include <cmath>
#include <sstream>

#include "apps/common/svg_plot.h"
#include "apps/common/text.h"

namespace circline::apps {
namespace {

constexpr double kWidth = 640.0, kNames = 286.0, kMarginRight = 64.0, kMarginTop = 34.0,
                 kRow = 20.0;
constexpr double kBox = 11.0, kBelow = 42.0;

struct Axis {
  double low, high;
  bool log;

  double X(double value) const {
    const double t = log ? std::log(std::max(value, low) / low) / std::log(high / low)
                         : (value - low) / (high - low);
    return kNames + std::clamp(t, 0.0, 1.0) * (kWidth - kMarginRight - kNames);
  }
};

// Whole decades on a logarithmic axis; from zero on a linear one.
Axis MakeAxis(const RowsPlot& plot) {
  constexpr double kSmallest = 1e-4;
  double low = 1e30, high = 0.0;
  for (const SvgRow& row : plot.rows) {
    low = std::min(low, plot.bars ? row.quantiles[2] : row.quantiles[0]);
    high = std::max(high, plot.bars ? row.quantiles[2] : row.quantiles[4]);
  }
  if (!plot.log_x) return {0.0, high > 0.0 ? 1.05 * high : 1.0, false};
  low = std::pow(10.0, std::floor(std::log10(std::max(low, kSmallest)) - (plot.bars ? 0.3 : 0.0)));
  return {low, std::max(10.0 * low, high * 1.1), true};
}

void DrawAxis(const RowsPlot& plot, const Axis& axis, double bottom, std::ostringstream* svg) {
  const std::vector<double> ticks = axis.log && axis.high / axis.low > 50.0
                                        ? DecadeTicks(axis.low, axis.high)
                                        : PlotTicks(axis.log, axis.low, axis.high);
  for (const double tick : ticks) {
    const std::string x = SvgNumber(axis.X(tick));
    *svg << "<path stroke='currentColor' stroke-opacity='.14' d='M" << x << " " << kMarginTop << "V"
         << SvgNumber(bottom) << "'/><text text-anchor='middle' font-size='11' fill='currentColor' "
         << "fill-opacity='.75' x='" << x << "' y='" << SvgNumber(bottom + 15) << "'>"
         << TickText(tick) << "</text>";
  }
  *svg << "<text text-anchor='middle' font-size='14' font-weight='600' fill='currentColor' x='"
       << kWidth / 2 << "' y='18'>" << EscapeHtml(plot.title)
       << "</text><text text-anchor='middle' font-size='12' fill='currentColor' x='"
       << SvgNumber((kNames + kWidth - kMarginRight) / 2) << "' y='" << SvgNumber(bottom + 34)
       << "'>" << EscapeHtml(plot.x_label) << "</text>";
}

void DrawBox(const SvgRow& row, const Axis& axis, double y, std::ostringstream* svg) {
  std::array<double, 5> x{};
  for (std::size_t i = 0; i < 5; ++i) x[i] = axis.X(row.quantiles[i]);
  *svg << "<path stroke='" << row.color << "' d='M" << SvgNumber(x[0]) << " " << SvgNumber(y) << "H"
       << SvgNumber(x[1]) << "M" << SvgNumber(x[3]) << " " << SvgNumber(y) << "H" << SvgNumber(x[4])
       << "'/><rect fill='" << row.color << "' fill-opacity='.25' stroke='" << row.color << "' x='"
       << SvgNumber(x[1]) << "' y='" << SvgNumber(y - kBox / 2) << "' width='"
       << SvgNumber(std::max(1.0, x[3] - x[1])) << "' height='" << SvgNumber(kBox)
       << "'/><path stroke-width='2.5' stroke='" << row.color << "' d='M" << SvgNumber(x[2]) << " "
       << SvgNumber(y - kBox / 2) << "v" << SvgNumber(kBox) << "'/>";
}

void DrawBar(const SvgRow& row, const Axis& axis, double y, std::ostringstream* svg) {
  *svg << "<rect fill='" << row.color << "' fill-opacity='.75' x='" << SvgNumber(kNames) << "' y='"
       << SvgNumber(y - kBox / 2) << "' width='"
       << SvgNumber(std::max(1.0, axis.X(row.quantiles[2]) - kNames)) << "' height='"
       << SvgNumber(kBox) << "'/>";
}

}  // namespace

std::string RenderRows(const RowsPlot& plot) {
  if (plot.rows.empty()) return "";
  const Axis axis = MakeAxis(plot);
  const double bottom = kMarginTop + kRow * static_cast<double>(plot.rows.size());
  std::ostringstream svg;
  svg << "<svg viewBox='0 0 " << kWidth << " " << SvgNumber(bottom + kBelow)
      << "' role='img' font-family='system-ui,sans-serif'>";
  DrawAxis(plot, axis, bottom, &svg);
  double y = kMarginTop + kRow / 2;
  for (const SvgRow& row : plot.rows) {
    svg << "<g><title>" << EscapeHtml(row.name + ": " + row.label) << "</title>"
        << "<text text-anchor='end' font-size='11' fill='currentColor' x='" << kNames - 8 << "' y='"
        << SvgNumber(y + 4) << "'>" << EscapeHtml(row.name) << "</text>";
    (plot.bars ? DrawBar : DrawBox)(row, axis, y, &svg);
    svg << "<text font-size='11' fill='currentColor' fill-opacity='.75' x='"
        << kWidth - kMarginRight + 6 << "' y='" << SvgNumber(y + 4) << "'>" << EscapeHtml(row.label)
        << "</text></g>";
    y += kRow;
  }
  svg << "</svg>";
  return svg.str();
}

}  // namespace circline::apps
