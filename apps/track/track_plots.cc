#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "apps/common/svg_plot.h"
#include "apps/track/track_report.h"
#include "circline/estimators/basics.h"
#include "circline/estimators/pose.h"

namespace circline::apps {
namespace {

constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kMostPoints = 2000;  // Of a plot; more make a browser slow.

using Value = std::function<double(const TrackedFrame&)>;

double Or(const std::optional<double>& value) { return value.value_or(kNone); }

// Limits that hold all values of the plot's series, with a margin.
void FitAxes(Plot* plot) {
  double low = 1e300, high = -1e300;
  for (const PlotSeries& series : plot->series) {
    for (const auto& [x, y] : series.points) {
      if (!std::isfinite(y) || (plot->log_y && !(y > 0.0))) continue;
      low = std::min(low, y);
      high = std::max(high, y);
    }
  }
  if (!(low <= high)) return;
  if (plot->log_y) {
    plot->y_min = std::pow(10.0, std::floor(std::log10(low)));
    plot->y_max = std::pow(10.0, std::ceil(std::log10(high) + 1e-9));
    return;
  }
  const double margin = std::max(0.05 * (high - low), 1e-3 * std::max(std::abs(high), 1e-3));
  plot->y_min = low - margin;
  plot->y_max = high + margin;
}

class TimePlots {
 public:
  explicit TimePlots(const std::vector<TrackedFrame>& frames)
      : frames_(frames), stride_(1 + frames.size() / kMostPoints) {}

  PlotSeries Series(const std::string& name, std::size_t color, const Value& value) const {
    PlotSeries series;
    series.name = name;
    series.color = SeriesColor(color);
    for (std::size_t i = 0; i < frames_.size(); i += stride_) {
      const TrackedFrame& frame = frames_[i];
      // Another world, be it since a frame that is passed over.
      const auto end = frames_.begin() + static_cast<std::ptrdiff_t>(i) + 1;
      const bool begins = std::any_of(end - static_cast<std::ptrdiff_t>(std::min(stride_, i + 1)),
                                      end, [](const TrackedFrame& f) { return f.reinitialized; });
      if (begins) series.points.emplace_back(frame.time_s, kNone);
      series.points.emplace_back(frame.time_s, value(frame));
    }
    // A value with none beside it has no line: it is a dot.
    const auto known = [&](std::size_t i) {
      return i < series.points.size() && std::isfinite(series.points[i].second);
    };
    for (std::size_t i = 0; i < series.points.size() && !series.dots; ++i)
      series.dots = known(i) && (i == 0 || !known(i - 1)) && !known(i + 1);
    return series;
  }

  void Add(const std::string& title, const std::string& y_label, bool log_y, bool percent,
           std::vector<PlotSeries> series) {
    Plot plot;
    plot.title = title;
    plot.x_label = "time, seconds";
    plot.y_label = y_label;
    plot.log_y = log_y;
    plot.percent_y = percent;
    plot.x_min = frames_.front().time_s;
    plot.x_max = std::max(plot.x_min + 1e-3, frames_.back().time_s);
    for (const TrackedFrame& f : frames_) {
      plot.x_min = std::min(plot.x_min, f.time_s);
      plot.x_max = std::max(plot.x_max, f.time_s);
    }
    plot.series = std::move(series);
    const auto is_empty = [log_y](const PlotSeries& s) {
      return std::none_of(s.points.begin(), s.points.end(), [log_y](const auto& p) {
        return std::isfinite(p.second) && (!log_y || p.second > 0.0);
      });
    };
    plot.series.erase(std::remove_if(plot.series.begin(), plot.series.end(), is_empty),
                      plot.series.end());
    if (plot.series.empty()) return;
    if (!percent) FitAxes(&plot);
    html_ += "<div>" + RenderSvg(plot) + "</div>";
  }
  std::string Html() const { return "<div class='plots'>" + html_ + "</div>"; }

 private:
  const std::vector<TrackedFrame>& frames_;
  std::size_t stride_;
  std::string html_;
};

// Of the camera since the track began, a turn by its components, degrees: rotation vectors jump at
// half a turn only.
std::vector<Eigen::Vector3d> TurnsSinceStart(const std::vector<TrackedFrame>& frames) {
  std::vector<Eigen::Vector3d> turns;
  Eigen::Matrix3d first = Eigen::Matrix3d::Identity();
  bool has_first = false;
  for (const TrackedFrame& f : frames) {
    if (f.has_pose && (f.reinitialized || !has_first)) {
      first = f.rotation;
      has_first = true;
    }
    turns.push_back(f.has_pose
                        ? Eigen::Vector3d(LogRotation(f.rotation * first.transpose()) / kDegree)
                        : Eigen::Vector3d::Constant(kNone));
  }
  return turns;
}

}  // namespace

std::string TrackPlots(const std::vector<TrackedFrame>& frames) {
  TimePlots plots(frames);
  const std::vector<Eigen::Vector3d> turns = TurnsSinceStart(frames);
  std::vector<PlotSeries> rotation, position, probability;
  static constexpr std::array<const char*, 3> kNames = {"x", "y", "z"};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    rotation.push_back(
        plots.Series(std::string("about ") + kNames[k], k, [&, axis](const TrackedFrame& f) {
          return turns[static_cast<std::size_t>(&f - frames.data())][axis];
        }));
    position.push_back(plots.Series(kNames[k], k, [axis](const TrackedFrame& f) {
      return f.has_pose ? f.center[axis] : kNone;
    }));
  }
  std::size_t most = 0;
  for (const TrackedFrame& f : frames) most = std::max(most, f.probabilities.size());
  for (std::size_t k = 0; k < std::min<std::size_t>(most, 4); ++k) {
    probability.push_back(
        plots.Series("hypothesis " + std::to_string(k + 1), k, [k](const TrackedFrame& f) {
          return k < f.probabilities.size() ? f.probabilities[k] : kNone;
        }));
  }
  plots.Add("Turn of the camera since the track began", "degrees", false, false,
            std::move(rotation));
  plots.Add("Position of the camera in the world", "world units", false, false,
            std::move(position));
  plots.Add("Probabilities", "probability", false, true, std::move(probability));
  plots.Add("How well the pose is known", "degrees", true, false,
            {plots.Series("standard deviation of the normal", 0,
                          [](const TrackedFrame& f) { return Or(f.sigma_deg); }),
             plots.Series("error, where the truth is known", 1,
                          [](const TrackedFrame& f) { return Or(f.error_deg); })});
  plots.Add("NEES of the rotation", "by degree of freedom (expected 1)", true, false,
            {plots.Series("NEES", 0, [](const TrackedFrame& f) { return Or(f.nees); })});
  plots.Add("Time for a frame", "milliseconds", true, false,
            {plots.Series("features", 0,
                          [](const TrackedFrame& f) {
                            return f.error.empty() ? 1e-3 * f.observe_us : kNone;
                          }),
             plots.Series("pose", 1, [](const TrackedFrame& f) {
               return f.has_pose ? 1e-3 * f.track_us : kNone;
             })});
  return plots.Html();
}

}  // namespace circline::apps
