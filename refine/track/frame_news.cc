#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "circline/estimators/geometric_residuals.h"
#include "circline/refine/track/track_steps.h"

namespace circline {

double FrameNews::Shape::Distance2(const CalibratedPoint& p) const {
  const double distance = is_circle ? ConicDistancePx(p, conic) : LineDistancePx(p, line);
  return distance * distance;
}

double FrameNews::OfLast(double weight, const Camera& camera,
                         const std::vector<Eigen::Vector2d>& points,
                         const std::vector<std::uint8_t>& inliers) {
  if (!(weight < 1.0)) return 1.0;
  const Shape& now = now_[now_.size() - 1];
  const std::size_t enough = now.is_circle ? 16 : 4;  // Points; every line meets all of its pencil.
  points_.clear();
  CalibratedPoint point;
  for (std::size_t i = 0; i < points.size();
       i += std::max<std::size_t>(1, points.size() / enough)) {
    if ((inliers.empty() || inliers[i] != 0) && PixelToCalibrated(camera, points[i], &point))
      points_.push_back(point);
  }
  if (points_.empty()) return 1.0;
  // Farther from what it was than from what it is; of lines, than from the nearest of the pencil.
  double moved2 = std::numeric_limits<double>::infinity();
  for (const Shape& before : before_) {
    if (before.is_circle != now.is_circle || before.id != now.id) continue;
    double sum = 0.0;
    for (const CalibratedPoint& p : points_) sum += before.Distance2(p) - now.Distance2(p);
    moved2 = std::min(moved2, std::max(0.0, sum / static_cast<double>(points_.size())));
  }
  const double r = std::exp(-0.5 * moved2);
  return (1.0 - r) / (weight * (1.0 - r) + (1.0 - weight) * (1.0 + r));
}

double FrameNews::Next(const Observations& fitted, const NoiseModel& noise) {
  std::swap(before_, now_);
  now_.Shorten(0);
  double news = 0.0;
  for (const CircleObservation& c : fitted.circles) {
    if (!c.fit) continue;
    Shape& shape = now_.Add();
    shape.id = c.id;
    shape.is_circle = true;
    shape.conic = c.fit->conic;
    const double weight = noise.ContourWeight(c.sigma_px, c.points, c.inliers);
    news += OfLast(weight, fitted.camera, c.points, c.inliers);
  }
  for (const PencilObservation& pencil : fitted.pencils) {
    for (const LineObservation& line : pencil.lines) {
      if (!line.fit) continue;
      Shape& shape = now_.Add();
      shape.id = pencil.id;
      shape.is_circle = false;
      shape.line = line.fit->line;
      news += OfLast(noise.LineWeight(LineSigma(pencil, line), line.points, line.inliers),
                     fitted.camera, line.points, line.inliers);
    }
  }
  return now_.empty() ? 1.0 : news / static_cast<double>(now_.size());
}

}  // namespace circline
