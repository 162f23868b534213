#include "apps/common/svg_plot.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>

#include "apps/common/text.h"

namespace circline::apps {
namespace {

constexpr double kLeft = 58.0, kRight = 14.0, kTop = 30.0, kBottom = 46.0;
constexpr double kLegendRow = 18.0;
constexpr double kTickText = 6.5;      // Width of a digit of a label, half of a line's height.
constexpr std::size_t kLongName = 32;  // Longer ones stand one below the other.

// A place or length in the picture, to a tenth.
std::string SvgNumber(double value) { return FormatFixed(value, 1); }

std::string TickText(double value) {
  if (value == 0.0) return "0";
  if (std::abs(value) < 1e-4) return FormatShort(value, 1);
  std::string text = FormatFixed(value, 4);
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

// Of the way from `low` to `high`, on a linear or logarithmic axis.
double ShareOfAxis(double value, double low, double high, bool log) {
  const double share =
      log ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
  return std::clamp(share, 0.0, 1.0);
}

struct Frame {
  const Plot& plot;

  double right() const { return plot.width - kRight; }
  double bottom() const { return plot.height - kBottom; }
  double X(double x) const {
    return kLeft + ShareOfAxis(x, plot.x_min, plot.x_max, plot.log_x) * (right() - kLeft);
  }
  double Y(double y) const {
    return bottom() - ShareOfAxis(y, plot.y_min, plot.y_max, plot.log_y) * (bottom() - kTop);
  }
};

// Round values (1, 2, 5 times a power of ten) that cut the range into about five.
std::vector<double> LinearTicks(double low, double high) {
  const double raw = (high - low) / 5.0;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  const double step = raw / power < 1.5   ? power
                      : raw / power < 3.5 ? 2 * power
                      : raw / power < 7.5 ? 5 * power
                                          : 10 * power;
  std::vector<double> ticks;
  for (double i = std::ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i += 1.0) {
    ticks.push_back(i * step);
  }
  return ticks;
}

// 1, 2 and 5 times powers of ten.
std::vector<double> LogTicks(double low, double high) {
  std::vector<double> ticks;
  for (int decade = static_cast<int>(std::floor(std::log10(low))); decade < 12; ++decade) {
    for (const double factor : {1.0, 2.0, 5.0}) {
      const double value = factor * std::pow(10.0, decade);
      if (value > high * 1.0001) return ticks;
      if (value >= low * 0.9999) ticks.push_back(value);
    }
  }
  return ticks;
}

void DrawGrid(const Frame& frame, std::ostringstream* svg) {
  const Plot& plot = frame.plot;
  *svg << "<g stroke='currentColor' stroke-opacity='.14'>";
  const std::vector<double> x_ticks = PlotTicks(plot.log_x, plot.x_min, plot.x_max);
  const std::vector<double> y_ticks = PlotTicks(plot.log_y, plot.y_min, plot.y_max);
  for (const double x : x_ticks) {
    *svg << "<path d='M" << SvgNumber(frame.X(x)) << " " << kTop << "V" << SvgNumber(frame.bottom())
         << "'/>";
  }
  for (const double y : y_ticks) {
    *svg << "<path d='M" << kLeft << " " << SvgNumber(frame.Y(y)) << "H" << SvgNumber(frame.right())
         << "'/>";
  }
  *svg << "</g><g fill='currentColor' fill-opacity='.75' font-size='11'>";
  double free_x = 0.0, free_y = frame.bottom() + kTickText;  // Up to where no label stands yet.
  for (const double x : x_ticks) {
    const double half_width = 0.5 * kTickText * static_cast<double>(TickText(x).size());
    if (frame.X(x) - half_width < free_x) continue;
    free_x = frame.X(x) + half_width + kTickText;
    *svg << "<text text-anchor='middle' x='" << SvgNumber(frame.X(x)) << "' y='"
         << SvgNumber(frame.bottom() + 15) << "'>" << TickText(x) << "</text>";
  }
  for (const double y : y_ticks) {
    if (frame.Y(y) + kTickText > free_y) continue;
    free_y = frame.Y(y) - kTickText;
    *svg << "<text text-anchor='end' x='" << kLeft - 6 << "' y='" << SvgNumber(frame.Y(y) + 4)
         << "'>" << (plot.percent_y ? TickText(y * 100.0) + " %" : TickText(y)) << "</text>";
  }
  *svg << "</g>";
}

void DrawLabels(const Frame& frame, std::ostringstream* svg) {
  const Plot& plot = frame.plot;
  const double middle_x = (kLeft + frame.right()) / 2, middle_y = (kTop + frame.bottom()) / 2;
  *svg << "<text text-anchor='middle' font-size='14' font-weight='600' fill='currentColor' x='"
       << SvgNumber(middle_x) << "' y='18'>" << EscapeHtml(plot.title) << "</text>"
       << "<text text-anchor='middle' font-size='12' fill='currentColor' x='" << SvgNumber(middle_x)
       << "' y='" << SvgNumber(frame.bottom() + 34) << "'>" << EscapeHtml(plot.x_label) << "</text>"
       << "<text text-anchor='middle' font-size='12' fill='currentColor' transform='translate(13 "
       << SvgNumber(middle_y) << ") rotate(-90)'>" << EscapeHtml(plot.y_label) << "</text>"
       << "<rect fill='none' stroke='currentColor' stroke-opacity='.5' x='" << kLeft << "' y='"
       << kTop << "' width='" << SvgNumber(frame.right() - kLeft) << "' height='"
       << SvgNumber(frame.bottom() - kTop) << "'/>";
}

void DrawSeries(const Frame& frame, const PlotSeries& series, std::ostringstream* svg) {
  *svg << "<path fill='none' stroke-width='2' stroke-linejoin='round' stroke='" << series.color
       << "'" << (series.dashed ? " stroke-dasharray='5 3'" : "") << " d='";
  bool pen_down = false;
  const auto is_usable = [&frame](double x, double y) {
    return std::isfinite(x) && std::isfinite(y) && (!frame.plot.log_x || x > 0.0) &&
           (!frame.plot.log_y || y > 0.0);
  };
  for (const auto& [x, y] : series.points) {
    const bool usable = is_usable(x, y);
    if (usable)
      *svg << (pen_down ? "L" : "M") << SvgNumber(frame.X(x)) << " " << SvgNumber(frame.Y(y));
    pen_down = usable;
  }
  *svg << "'><title>" << EscapeHtml(series.name) << "</title></path>";
  for (const auto& [x, y] : series.points) {
    if (!series.dots || !is_usable(x, y)) continue;
    *svg << "<circle r='3' fill='" << series.color << "' cx='" << SvgNumber(frame.X(x)) << "' cy='"
         << SvgNumber(frame.Y(y)) << "'/>";
  }
}

std::size_t LegendColumns(const Plot& plot) {
  const bool is_long = std::any_of(plot.series.begin(), plot.series.end(),
                                   [](const PlotSeries& s) { return s.name.size() > kLongName; });
  return is_long ? 1 : 2;
}

void DrawLegend(const Frame& frame, std::ostringstream* svg) {
  const std::size_t columns = LegendColumns(frame.plot);
  const double column_width = (frame.right() - kLeft) / static_cast<double>(columns);
  for (std::size_t i = 0; i < frame.plot.series.size(); ++i) {
    const PlotSeries& series = frame.plot.series[i];
    const std::size_t column = i % columns, row = i / columns;
    const double x = kLeft + static_cast<double>(column) * column_width;
    const double y = frame.plot.height + static_cast<double>(row) * kLegendRow + 8;
    *svg << "<path stroke-width='2.5' stroke='" << series.color << "'"
         << (series.dashed ? " stroke-dasharray='5 3'" : "") << " d='M" << SvgNumber(x) << " "
         << SvgNumber(y - 4) << "h22'/><text font-size='12' fill='currentColor' x='"
         << SvgNumber(x + 28) << "' y='" << SvgNumber(y) << "'>" << EscapeHtml(series.name)
         << "</text>";
  }
}

}  // namespace

std::vector<double> PlotTicks(bool log, double low, double high) {
  if (!log) return LinearTicks(low, high);
  const std::vector<double> ticks = LogTicks(low, high);
  return ticks.size() < 3 ? LinearTicks(low, high) : ticks;  // Hardly a decade: round values.
}

std::string RenderSvg(const Plot& plot) {
  const Frame frame{plot};
  const std::size_t columns = LegendColumns(plot);
  const std::size_t rows = (plot.series.size() + columns - 1) / columns;
  const double height = plot.height + static_cast<double>(rows) * kLegendRow;
  std::ostringstream svg;
  svg << "<svg viewBox='0 0 " << plot.width << " " << SvgNumber(height)
      << "' role='img' font-family='system-ui,sans-serif'>";
  DrawGrid(frame, &svg);
  for (const PlotSeries& series : plot.series) DrawSeries(frame, series, &svg);
  DrawLabels(frame, &svg);
  DrawLegend(frame, &svg);
  svg << "</svg>";
  return svg.str();
}

std::string SeriesColor(std::size_t index) {
  static constexpr std::array<const char*, 10> kColors = {
      "#d1495b", "#2e86de", "#2a9d5c", "#e08e0b", "#8e5bd0",
      "#17a2b8", "#b5651d", "#d63fa6", "#6b7f1f", "#5c6b7a"};
  return kColors[index % kColors.size()];
}

}  // namespace circline::apps
