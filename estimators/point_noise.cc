#include "circline/estimators/point_noise.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace circline {
namespace {

using Scatter = PointNoiseMeter::Scatter;

// Posterior mean of a variance with a scaled inverse chi-square prior of `worth` degrees of
// freedom: (worth prior + sum of squares) / (freedom + worth - 2), which is finite from two degrees
// on.
double Shrink(const Scatter& scatter, double prior_px, double worth = 1.0) {
  return std::sqrt((worth * prior_px * prior_px + scatter.freedom * scatter.variance) /
                   std::max(worth, scatter.freedom + worth - 2.0));
}

Scatter FromSquares(double mean_square, double n, double parameters) {
  const double freedom = n - parameters;
  if (!(freedom > 0.0) || !std::isfinite(mean_square)) return {};
  return {mean_square * n / freedom, freedom};
}

// Of the residuals within three standard deviations, these from the median absolute residual.
Scatter FromMost(const std::vector<double>& residuals, std::vector<double>* sizes,
                 double parameters) {
  if (residuals.empty()) return {};
  sizes->clear();
  for (const double r : residuals) sizes->push_back(std::abs(r));
  const auto middle = sizes->begin() + static_cast<std::ptrdiff_t>(sizes->size() / 2);
  std::nth_element(sizes->begin(), middle, sizes->end());
  const double gate = 3.0 * 1.4826 * *middle;
  double n = 0.0, squares = 0.0;
  for (const double r : *sizes) {
    if (r > gate) continue;
    n += 1.0;
    squares += r * r;
  }
  constexpr double kVarianceWithinGate = 0.9733;  // Of a unit Gaussian cut off at three.
  return FromSquares(squares / (n * kVarianceWithinGate), n, parameters);
}

double Count(const std::vector<std::uint8_t>& mask) {
  return static_cast<double>(mask.size()) -
         static_cast<double>(std::count(mask.begin(), mask.end(), 0));
}

bool IsSegment(const LineObservation& line) {
  return line.inliers.empty() ? line.points.size() == 2 : Count(line.inliers) == 2.0;
}

double Freedom(const std::vector<Scatter>& scatters) {
  double freedom = 0.0;
  for (const Scatter& s : scatters) freedom += s.freedom;
  return freedom;
}

}  // namespace

// Of a feature's points about its fit, by the fit's own figure where that left a mask.
template <typename Feature, typename Distance>
Scatter PointNoiseMeter::OfPoints(const Feature& feature, double parameters,
                                  const Distance& distance) {
  if (!feature.inliers.empty()) {
    const double rms = feature.fit->rms_px;
    return FromSquares(rms * rms, Count(feature.inliers), parameters);
  }
  CalibrateInliers(fitted_->camera, feature.points, {}, &points_);
  residuals_.clear();
  for (const CalibratedPoint& p : points_) residuals_.push_back(distance(p));
  return FromMost(residuals_, &sizes_, parameters);
}

Scatter PointNoiseMeter::OfCircle(const CircleObservation& circle) {
  if (circle.sigma_px > 0.0 || !circle.fit) return {};
  Scatter s = OfPoints(circle, 5.0, [&circle](const CalibratedPoint& p) {
    return ConicDistancePx(p, circle.fit->conic);
  });
  const double rms = std::sqrt(s.variance);
  s.freedom = std::min(s.freedom, model_->ContourFreedom(rms, circle.points, circle.inliers));
  return s;
}

Scatter PointNoiseMeter::OfLine(const PencilObservation& pencil, const LineObservation& line) {
  if (LineSigma(pencil, line) > 0.0 || !line.fit || IsSegment(line)) return {};
  Scatter s = OfPoints(
      line, 2.0, [&line](const CalibratedPoint& p) { return LineDistancePx(p, line.fit->line); });
  const double rms = std::sqrt(s.variance);
  s.freedom = std::min(s.freedom, model_->LineFreedom(rms, line.points, line.inliers));
  return s;
}

// All segments of two points together: their misses of the vanishing point in standard
// deviations, if the end points' were 1 px.
Scatter PointNoiseMeter::OfSegments(const PencilObservation& pencil) {
  if (!pencil.fit) return {};
  residuals_.clear();
  double num_lines = 0.0, squares = 0.0;
  bool has_masks = true;
  for (const LineObservation& line : pencil.lines) {
    if (!line.fit || !line.is_parallel) continue;
    num_lines += 1.0;
    if (LineSigma(pencil, line) > 0.0 || !IsSegment(line)) continue;
    has_masks = has_masks && !line.inliers.empty();
    CalibrateInliers(fitted_->camera, line.points, line.inliers, &points_);
    LineFit unit;
    if (!FitLine(points_, 1.0, &unit).ok()) continue;
    residuals_.push_back(VanishingPointResidual(unit, pencil.fit->direction));
    squares += residuals_.back() * residuals_.back();
  }
  if (residuals_.empty()) return {};
  // The two parameters of the vanishing point, shared out among all lines.
  const double n = static_cast<double>(residuals_.size()), parameters = 2.0 * n / num_lines;
  return has_masks ? FromSquares(squares / n, n, parameters)
                   : FromMost(residuals_, &sizes_, parameters);
}

// The noise that half of the degrees of freedom exceed.
double PointNoiseMeter::Common(const std::vector<Scatter>& scatters, double default_px,
                               double worth) {
  const double freedom = Freedom(scatters);
  sorted_ = scatters;
  for (Scatter& s : sorted_) {
    // The median of chi-square over its mean (Wilson and Hilferty 1931), so that few degrees of
    // freedom each do not pull the median down.
    const double cube_root = 1.0 - 2.0 / (9.0 * std::max(1.0, s.freedom));
    s.variance /= cube_root * cube_root * cube_root;
  }
  if (!(freedom > 0.0)) return default_px;
  std::sort(sorted_.begin(), sorted_.end(),
            [](const Scatter& a, const Scatter& b) { return a.variance < b.variance; });
  double below = 0.0;
  std::size_t i = 0;
  while (below + sorted_[i].freedom < 0.5 * freedom) below += sorted_[i++].freedom;
  return Shrink({sorted_[i].variance, freedom}, default_px, worth);
}

PointNoise MeasurePointNoise(const Observations& fitted, const NoiseModel& model,
                             double conic_default_px, double line_default_px) {
  PointNoise noise;
  PointNoiseMeter().Measure(fitted, model, &noise, conic_default_px, line_default_px);
  return noise;
}

void StateNoise(const PointNoise& noise, double conic_px, double line_px,
                Observations* observations) {
  for (std::size_t i = 0; i < observations->circles.size(); ++i) {
    double& sigma = observations->circles[i].sigma_px;
    if (!(sigma > 0.0)) sigma = conic_px > 0.0 ? conic_px : noise.circles[i];
  }
  for (std::size_t i = 0; i < observations->pencils.size(); ++i) {
    PencilObservation& pencil = observations->pencils[i];
    for (std::size_t j = 0; j < pencil.lines.size(); ++j) {
      double& sigma = pencil.lines[j].sigma_px;
      sigma = LineSigma(pencil, pencil.lines[j]);
      if (!(sigma > 0.0)) sigma = line_px > 0.0 ? line_px : noise.lines[i][j];
    }
  }
}

void PointNoiseMeter::Measure(const Observations& fitted, const NoiseModel& model,
                              PointNoise* noise, double conic_default_px, double line_default_px) {
  fitted_ = &fitted;
  model_ = &model;
  circles_.clear();
  lines_.clear();
  for (const CircleObservation& circle : fitted.circles) circles_.push_back(OfCircle(circle));
  for (const PencilObservation& pencil : fitted.pencils) {
    lines_.push_back(OfSegments(pencil));
    for (const LineObservation& line : pencil.lines) lines_.push_back(OfLine(pencil, line));
  }
  // A photo is about as sharp along its lines as along its contours. Where many points of the one
  // kind say how sharp, that counts as ten residuals of the other would: segments have few of their
  // own, and so have small contours.
  constexpr double kMany = 20.0, kWorth = 10.0;
  const bool many_on_circles = Freedom(circles_) >= kMany, many_on_lines = Freedom(lines_) >= kMany;
  const bool lines_tell = many_on_lines && !many_on_circles;
  const double conic_worth = lines_tell ? kWorth : 1.0;
  // Posterior means of few residuals are high, and a small contour's is one of another: with the
  // noise of the lines for a default, it would too often be half as much again (PointNoise tests).
  const double proportion = conic_default_px / line_default_px;
  noise->conic_px =
      Common(circles_, lines_tell ? proportion * Common(lines_, line_default_px) : conic_default_px,
             conic_worth);
  noise->circles.clear();
  for (std::size_t i = 0; i < circles_.size(); ++i) {
    const double stated = fitted.circles[i].sigma_px;
    noise->circles.push_back(stated > 0.0 ? stated
                                          : Shrink(circles_[i], noise->conic_px, conic_worth));
  }
  const double worth = many_on_circles ? kWorth : 1.0;
  noise->line_px = Common(lines_, many_on_circles ? noise->conic_px : line_default_px, worth);
  std::size_t next = 0;
  noise->lines.resize(fitted.pencils.size());
  auto of_pencil_lines = noise->lines.begin();
  for (const PencilObservation& pencil : fitted.pencils) {
    const Scatter segments = lines_[next++];
    std::vector<double>& sigmas = *of_pencil_lines++;
    sigmas.clear();
    for (const LineObservation& line : pencil.lines) {
      const Scatter own = lines_[next++];
      const double stated = LineSigma(pencil, line);
      const bool of_pencil = IsSegment(line) && line.is_parallel;
      sigmas.push_back(stated > 0.0 ? stated
                       : of_pencil  ? Shrink(segments, noise->line_px, worth)
                                    : Shrink(own, noise->line_px));
    }
  }
}

}  // namespace circline
