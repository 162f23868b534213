#include "circline/refine/frame_news.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "circline/estimators/geometric_residuals.h"

namespace circline {
namespace {

// Of a feature, by how much of its variance is new in every frame (`weight` of NoiseModel, less
// than 1), and the coefficient of the rest.
double News(double weight, double r) {
  return 1.0 / (weight + (1.0 - weight) * (1.0 + r) / (1.0 - r));
}

}  // namespace

double FrameNews::Shape::Distance2(const CalibratedPoint& p) const {
  const double distance = is_circle ? ConicDistancePx(p, conic) : LineDistancePx(p, line);
  return distance * distance;
}

double FrameNews::Coefficient(const Camera& camera, const std::vector<Eigen::Vector2d>& points,
                              const std::vector<std::uint8_t>& inliers) {
  const Shape& now = now_[now_.size() - 1];
  const std::size_t enough = now.is_circle ? 16 : 4;  // Points; every line meets all of its pencil.
  points_.clear();
  CalibratedPoint point;
  for (std::size_t i = 0; i < points.size();
       i += std::max<std::size_t>(1, points.size() / enough)) {
    if ((inliers.empty() || inliers[i] != 0) && PixelToCalibrated(camera, points[i], &point))
      points_.push_back(point);
  }
  if (points_.empty()) return 0.0;
  // Farther from what it was than from what it is; of lines, than from the nearest of the pencil.
  double moved2 = std::numeric_limits<double>::infinity();
  for (const Shape& before : before_) {
    if (before.is_circle != now.is_circle || before.id != now.id) continue;
    double sum = 0.0;
    for (const CalibratedPoint& p : points_) sum += before.Distance2(p) - now.Distance2(p);
    moved2 = std::min(moved2, std::max(0.0, sum / static_cast<double>(points_.size())));
  }
  return std::exp(-0.5 * moved2);
}

double FrameNews::Next(const Observations& fitted, const NoiseModel& noise) {
  std::swap(before_, now_);
  now_.Shorten(0);
  double news = 0.0;
  for (const CircleObservation& circle : fitted.circles) {
    if (!circle.fit) continue;
    Shape& shape = now_.Add();
    shape.id = circle.id;
    shape.is_circle = true;
    shape.conic = circle.fit->conic;
    const double weight = noise.ContourWeight(circle.sigma_px, circle.points, circle.inliers);
    news += weight < 1.0 ? News(weight, Coefficient(fitted.camera, circle.points, circle.inliers))
                         : 1.0;
  }
  for (const PencilObservation& pencil : fitted.pencils) {
    for (const LineObservation& line : pencil.lines) {
      if (!line.fit) continue;
      Shape& shape = now_.Add();
      shape.id = pencil.id;
      shape.is_circle = false;
      shape.line = line.fit->line;
      const double weight = noise.LineWeight(LineSigma(pencil, line), line.points, line.inliers);
      news +=
          weight < 1.0 ? News(weight, Coefficient(fitted.camera, line.points, line.inliers)) : 1.0;
    }
  }
  return now_.empty() ? 1.0 : news / static_cast<double>(now_.size());
}

}  // namespace circline
