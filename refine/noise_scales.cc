#include "circline/refine/noise_scales.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "circline/refine/graduated.h"

namespace circline {
namespace {

// 1.4826 x the median of |values|: the standard deviation of a Gaussian, whatever the outliers.
double MadSigma(std::vector<double> values) {
  if (values.empty()) return 0.0;
  for (double& v : values) v = std::abs(v);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return 1.4826 * *middle;
}

// The same of absolute residuals; `parameters` of their degrees of freedom are spent.
double MadSigma(std::vector<double> values, std::size_t parameters) {
  constexpr std::size_t kEnough = 8;
  if (values.size() < parameters + kEnough) return 0.0;
  const double n = static_cast<double>(values.size());
  return MadSigma(std::move(values)) * std::sqrt(n / (n - static_cast<double>(parameters)));
}

// Scatter of the points about their own fits, the degrees of freedom of each fit counted in.
double ConicScale(const Observations& observations) {
  std::vector<double> residuals;
  std::vector<CalibratedPoint> points;
  for (const CircleObservation& circle : observations.circles) {
    if (!circle.fit || circle.sigma_px > 0.0) continue;
    CalibrateInliers(observations.camera, circle.points, circle.inliers, &points);
    if (points.size() <= 5) continue;
    const double n = static_cast<double>(points.size());
    const double gain = std::sqrt(n / (n - 5.0));
    for (const CalibratedPoint& p : points)
      residuals.push_back(gain * ConicDistancePx(p, circle.fit->conic));
  }
  return MadSigma(std::move(residuals));
}

// The same for lines of more than two points; segments known by their ends alone are judged by how
// far they miss their pencil's vanishing point, in standard deviations if the ends' were 1 px.
double LineScale(const Observations& observations) {
  std::vector<double> along, across;
  std::vector<CalibratedPoint> points;
  for (const PencilObservation& pencil : observations.pencils) {
    const double lines = static_cast<double>(pencil.lines.size());
    for (const LineObservation& line : pencil.lines) {
      if (!line.fit || LineSigma(pencil, line) > 0.0) continue;
      CalibrateInliers(observations.camera, line.points, line.inliers, &points);
      const double n = static_cast<double>(points.size());
      if (n > 2.0) {
        const double gain = std::sqrt(n / (n - 2.0));
        for (const CalibratedPoint& p : points)
          along.push_back(gain * LineDistancePx(p, line.fit->line));
      } else if (pencil.fit && lines > 2.0) {
        LineFit unit;
        if (!FitLine(points, 1.0, &unit).ok()) continue;
        across.push_back(std::sqrt(lines / (lines - 2.0)) *
                         VanishingPointResidual(unit, pencil.fit->direction));
      }
    }
  }
  constexpr std::size_t kEnough = 8;
  if (along.size() >= kEnough) return MadSigma(std::move(along));
  return across.size() >= kEnough ? MadSigma(std::move(across)) : 0.0;
}

}  // namespace

NoiseScales ScatterAboutFits(const Observations& fitted) {
  return {ConicScale(fitted), LineScale(fitted)};
}

NoiseScales ScatterAboutPose(const JointEvidence& e, const JointState& state) {
  if (std::all_of(e.sets.begin(), e.sets.end(),
                  [](const PointSet& set) { return set.noise == PointSet::Noise::kStated; })) {
    return {};
  }
  std::vector<double> of_circles, of_lines;
  std::size_t circles = 0, lines = 0;
  ForEachCurve(
      e, state,
      [&](const PointSet& set, bool is_circle, std::size_t, const std::vector<double>& distances) {
        if (set.noise == PointSet::Noise::kStated) return;
        std::vector<double>& all = is_circle ? of_circles : of_lines;
        ++(is_circle ? circles : lines);
        for (std::size_t i = 0; i < set.num_trusted; ++i) all.push_back(std::abs(distances[i]));
      });
  constexpr std::size_t kPerCircle = 3, kPerLine = 1, kPose = 3;
  return {MadSigma(std::move(of_circles), kPose + kPerCircle * circles),
          MadSigma(std::move(of_lines), kPose + kPerLine * lines)};
}

NoiseScales OrDefault(const NoiseScales& scales) {
  constexpr double kDefaultConicSigmaPx = 0.3;
  return {scales.conic_px > 0.0 ? scales.conic_px : kDefaultConicSigmaPx,
          scales.line_px > 0.0 ? scales.line_px : kDefaultLineSigmaPx};
}

bool RaiseScales(const NoiseScales& measured, NoiseScales* scales) {
  constexpr double kTolerated = 1.3;
  const bool conic = measured.conic_px > kTolerated * scales->conic_px;
  const bool line = measured.line_px > kTolerated * scales->line_px;
  if (conic) scales->conic_px = measured.conic_px;
  if (line) scales->line_px = measured.line_px;
  return conic || line;
}

Observations ApplyScales(const Observations& observations, const EstimationOptions& options,
                         const NoiseScales& scales) {
  Observations out = observations;
  const auto effective = [](const LossOptions& loss, double sigma, double bias, std::size_t n) {
    if (loss.scale_px > 0.0) return loss.scale_px;
    return std::sqrt(sigma * sigma + static_cast<double>(n) * bias * bias);
  };
  for (CircleObservation& circle : out.circles) {
    if (circle.sigma_px > 0.0) continue;
    circle.sigma_px = effective(options.conic_loss, scales.conic_px, options.contour_bias_px,
                                circle.points.size());
  }
  for (PencilObservation& pencil : out.pencils) {
    if (pencil.sigma_px > 0.0) continue;
    std::size_t longest = 2;
    for (const LineObservation& line : pencil.lines)
      longest = std::max(longest, line.points.size());
    pencil.sigma_px = effective(options.line_loss, scales.line_px, options.line_bias_px, longest);
  }
  return out;
}

}  // namespace circline
