#include "circline/estimators/exactness.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "circline/estimators/conic.h"

namespace circline {
namespace {

// Of a contour: neighbouring points, how many and what they miss by.
struct Piece {
  double num_points = 0.0, sum = 0.0, squares = 0.0;

  double Mean() const { return sum / num_points; }
};

// A point of a contour: where on the ellipse it lies (eccentric anomaly), where on the photo, and
// its distance from the ellipse, pixels.
struct PlacedPoint {
  double around;
  Eigen::Vector2d pixel;
  double distance;
};

std::vector<PlacedPoint> AlongContour(const CircleObservation& circle, const Camera& camera) {
  std::vector<PlacedPoint> points;
  Ellipse ellipse;
  if (!ConicToEllipse(circle.fit->conic, &ellipse)) return points;
  const Eigen::Vector2d major(std::cos(ellipse.angle), std::sin(ellipse.angle)),
      minor(-major.y(), major.x());
  for (std::size_t i = 0; i < circle.points.size(); ++i) {
    CalibratedPoint p;
    const bool is_inlier = circle.inliers.empty() || circle.inliers[i] != 0;
    if (!is_inlier || !PixelToCalibrated(camera, circle.points[i], &p)) continue;
    const Eigen::Vector2d away = p.x - ellipse.center;
    points.push_back({std::atan2(minor.dot(away) / ellipse.b, major.dot(away) / ellipse.a),
                      circle.points[i], ConicDistancePx(p, circle.fit->conic)});
  }
  std::sort(points.begin(), points.end(),
            [](const auto& a, const auto& b) { return a.around < b.around; });
  return points;
}

std::vector<Piece> PiecesOf(const std::vector<PlacedPoint>& points, double length_px) {
  std::vector<Piece> pieces;
  double length = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i > 0) length += (points[i].pixel - points[i - 1].pixel).norm();
    if (pieces.empty() || length > length_px) {
      pieces.emplace_back();
      length = 0.0;
    }
    Piece& piece = pieces.back();
    piece.num_points += 1.0;
    piece.sum += points[i].distance;
    piece.squares += points[i].distance * points[i].distance;
  }
  return pieces;
}

// What the pieces miss by, against what they would if they shared contour_px.
std::vector<Misfit> MisfitsOf(const std::vector<Piece>& pieces, double contour_px) {
  double within = 0.0, num_points = 0.0, inverses = 0.0, between = 0.0;
  for (const Piece& piece : pieces) {
    num_points += piece.num_points;
    inverses += 1.0 / piece.num_points;
    within += piece.squares - piece.sum * piece.Mean();
    between += piece.Mean() * piece.Mean();
  }
  const auto n = static_cast<double>(pieces.size());
  constexpr double kOfEllipse = 5.0, kLeast = 1e-3;  // Degrees of freedom; pixels.
  if (!(n > kOfEllipse) || !(num_points > n)) return {};
  const double own = std::max(kLeast * kLeast, within / (num_points - n) * inverses / n),
               shared = contour_px * contour_px;
  return {{between / (own + shared), n - kOfEllipse, shared / own}};
}

}  // namespace

double ExpectedScale(const std::vector<Misfit>& misfits, double spread, double most) {
  if (!(spread > 0.0)) return 1.0;
  constexpr double kLeast = 0.1;
  constexpr int kSteps = 40;
  double costs[kSteps + 1], scales[kSteps + 1];
  for (int k = 0; k <= kSteps; ++k) {
    const double s = scales[k] = kLeast * std::pow(most / kLeast, static_cast<double>(k) / kSteps);
    costs[k] = std::pow(std::log(s) / spread, 2.0);
    for (const Misfit& m : misfits) {
      const double variance = 1.0 + s * s * m.share;
      costs[k] += m.d2 * (1.0 + m.share) / variance + m.dof * std::log(variance);
    }
  }
  const double least = *std::min_element(costs, costs + kSteps + 1);
  double sum = 0.0, squares = 0.0;
  for (int k = 0; k <= kSteps; ++k) {
    const double probability = std::exp(0.5 * (least - costs[k]));
    sum += probability;
    squares += probability * scales[k] * scales[k];
  }
  return std::sqrt(squares / sum);
}

double ShapeSigma(const CircleObservation& circle, const Camera& camera, const NoiseModel& noise) {
  constexpr double kMost = 3.0;
  if (!(noise.circle_shape > 0.0) || !circle.fit) return noise.circle_shape;
  const std::vector<Piece> pieces = PiecesOf(AlongContour(circle, camera), noise.correlation_px);
  std::vector<Misfit> misfits;
  if (noise.contour_px > 0.0) misfits = MisfitsOf(pieces, noise.contour_px);
  return noise.circle_shape * ExpectedScale(misfits, noise.spread, kMost);
}

}  // namespace circline
