#include "apps/compare/pixel_ellipse.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/conic_fit.h"

namespace circline::apps {
namespace {

// Points closer than this (or three times their mean spacing) leave no gap between them.
constexpr double kSmallestGap = 2.0 * kPi / 36.0;

std::vector<Eigen::Vector2d> Inliers(const std::vector<Eigen::Vector2d>& points,
                                     const std::vector<std::uint8_t>& mask) {
  if (mask.empty()) return points;
  std::vector<Eigen::Vector2d> inliers;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (mask[i] != 0) inliers.push_back(points[i]);
  }
  return inliers;
}

double Coverage(const Ellipse& ellipse, const std::vector<Eigen::Vector2d>& points) {
  const double c = std::cos(ellipse.angle), s = std::sin(ellipse.angle);
  std::vector<double> turns;
  for (const Eigen::Vector2d& point : points) {
    const Eigen::Vector2d d = point - ellipse.center;
    turns.push_back(
        std::atan2((c * d.y() - s * d.x()) / ellipse.b, (c * d.x() + s * d.y()) / ellipse.a));
  }
  std::sort(turns.begin(), turns.end());
  const double gap_limit = std::max(kSmallestGap, 6.0 * kPi / static_cast<double>(turns.size()));
  double uncovered = 0.0;
  for (std::size_t i = 0; i < turns.size(); ++i) {
    const double next = i + 1 < turns.size() ? turns[i + 1] : turns[0] + 2.0 * kPi;
    if (next - turns[i] > gap_limit) uncovered += next - turns[i];
  }
  return 1.0 - uncovered / (2.0 * kPi);
}

}  // namespace

bool FitPixelEllipse(const CircleObservation& circle, PixelEllipse* result) {
  *result = {};
  const std::vector<Eigen::Vector2d> points = Inliers(circle.points, circle.inliers);
  result->num_points = static_cast<int>(points.size());
  if (points.size() < 5) return false;
  Eigen::AlignedBox2d extent;
  for (const Eigen::Vector2d& point : points) extent.extend(point);
  // Fitted in a frame in which the points have size 1; distances are pixels all the same.
  const Eigen::Vector2d middle = extent.center();
  const double size = std::max(extent.sizes().maxCoeff() / 2, 1e-9);
  std::vector<CalibratedPoint> scaled(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    scaled[i].x = (points[i] - middle) / size;
    scaled[i].x_from_pixel = {1.0 / size, 0.0, 0.0, 1.0 / size};
  }
  ConicFit fit;
  if (!FitConic(scaled, 1.0, &fit).ok() || !ConicToEllipse(fit.conic, &result->ellipse))
    return false;
  result->ellipse.center = middle + size * result->ellipse.center;
  result->ellipse.a *= size;
  result->ellipse.b *= size;
  result->coverage = Coverage(result->ellipse, points);
  return true;
}

Segment EndPoints(const LineObservation& line) {
  const std::vector<Eigen::Vector2d> points = Inliers(line.points, line.inliers);
  if (points.empty()) return {Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
  // Farthest from the first, then farthest from that: exact for points along a line.
  const auto farthest = [&points](const Eigen::Vector2d& from) {
    return *std::max_element(points.begin(), points.end(),
                             [&from](const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
                               return (a - from).squaredNorm() < (b - from).squaredNorm();
                             });
  };
  const Eigen::Vector2d one_end = farthest(points.front());
  return {farthest(one_end), one_end};
}

}  // namespace circline::apps
