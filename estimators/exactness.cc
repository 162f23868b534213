#include "circline/estimators/exactness.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "circline/estimators/basics.h"
#include "circline/estimators/conic.h"

namespace circline {
namespace {

// Neighbouring points of a contour, how many and what they miss by, pixels.
struct Piece {
  double num_points = 0.0, sum = 0.0, squares = 0.0;

  void operator+=(const Piece& more) {
    num_points += more.num_points;
    sum += more.sum;
    squares += more.squares;
  }
};

// What pieces say together.
struct PieceSums {
  double num_pieces = 0.0, num_points = 0.0, within = 0.0, inverses = 0.0, between = 0.0;

  void Add(const Piece& piece) {
    if (piece.num_points == 0.0) return;
    const double mean = piece.sum / piece.num_points;
    num_pieces += 1.0;
    num_points += piece.num_points;
    inverses += 1.0 / piece.num_points;
    within += piece.squares - piece.sum * mean;
    between += mean * mean;
  }
};

// Pieces of a contour, nothing where its conic is no ellipse: of so many pixels, or where there are
// few of these of twelfths of the way round, which show what is off three to six times around, as
// thick and sawn rims are; of four points or more.
PieceSums SumPieces(const std::vector<CalibratedPoint>& points, const Eigen::Matrix3d& conic,
                    double most_px) {
  constexpr double kPieces = 12.0, kLeastPoints = 4.0;
  // Bins of eccentric anomaly, each shorter than a piece of all but the largest.
  constexpr int kNumBins = 256;
  std::array<Piece, kNumBins> bins{};
  PieceSums sums;
  Ellipse ellipse;
  if (!ConicToEllipse(conic, &ellipse)) return sums;
  const Eigen::Rotation2Dd to_axes(-ellipse.angle);
  double calibrated_per_px = 0.0;
  for (const CalibratedPoint& point : points) {
    const Eigen::Vector2d away = to_axes * (point.x - ellipse.center);
    const double around = std::atan2(away.y() / ellipse.b, away.x() / ellipse.a);
    const double distance = ConicDistancePx(point, conic);
    const auto& J = point.x_from_pixel;
    calibrated_per_px += std::sqrt(std::abs(J[0] * J[3] - J[1] * J[2]));
    if (!std::isfinite(around + distance)) continue;
    const auto bin = static_cast<std::size_t>(0.5 * kNumBins * (around / kPi + 1.0));
    bins[std::min<std::size_t>(bin, kNumBins - 1)] += {1.0, distance, distance * distance};
  }
  const double px_per_calibrated = static_cast<double>(points.size()) / calibrated_per_px;
  const double a = ellipse.a, b = ellipse.b;  // Perimeter after Ramanujan.
  const double around_px =
      px_per_calibrated * kPi * (3.0 * (a + b) - std::sqrt((3.0 * a + b) * (a + 3.0 * b)));
  const double num_pieces = std::min(kPieces, static_cast<double>(points.size()) / kLeastPoints);
  const double length_px = std::min(most_px, around_px / num_pieces);
  const double step = 2.0 * kPi / kNumBins;
  const Eigen::Rotation2Dd turn(step);
  Eigen::Vector2d around(-1.0, 0.0);
  Piece piece;
  double length = 0.0;
  for (const Piece& bin : bins) {
    const double bin_px = step * px_per_calibrated * std::hypot(a * around.y(), b * around.x());
    if (length + bin_px > length_px) {
      sums.Add(piece);
      piece = Piece();
      length = 0.0;
    }
    length += bin_px;
    piece += bin;
    around = turn * around;
  }
  sums.Add(piece);
  return sums;
}

}  // namespace

double ExpectedScale(const Misfit* misfits, std::size_t num_misfits, double spread, double most) {
  if (!(spread > 0.0)) return 1.0;
  constexpr double kLeast = 0.1;
  constexpr int kSteps = 40;
  const double step = std::log(most / kLeast) / kSteps, ratio = std::exp(step);
  double costs[kSteps + 1], scales[kSteps + 1];
  double s = kLeast, log_s = std::log(kLeast);
  for (int k = 0; k <= kSteps; ++k, s *= ratio, log_s += step) {
    scales[k] = s;
    costs[k] = log_s * log_s / (spread * spread);
    for (const Misfit* m = misfits; m != misfits + num_misfits; ++m) {
      const double variance = 1.0 + s * s * m->share;
      costs[k] += m->d2 * (1.0 + m->share) / variance + m->dof * std::log(variance);
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

double Irregularity(const std::vector<CalibratedPoint>& points, const Eigen::Matrix3d& conic,
                    const NoiseModel& noise) {
  if (!(noise.circle_shape > 0.0 && noise.spread > 0.0)) return 1.0;
  constexpr double kMost = 3.0, kOfEllipse = 5.0, kLeast = 1e-3;  // -; degrees of freedom; pixels.
  const PieceSums sums = SumPieces(points, conic, noise.correlation_px);
  const double n = sums.num_pieces, shared = noise.contour_px * noise.contour_px;
  if (!(shared > 0.0 && n > kOfEllipse && sums.num_points > n))
    return ExpectedScale(nullptr, 0, noise.spread, kMost);
  const double own =
      std::max(kLeast * kLeast, sums.within / (sums.num_points - n) * sums.inverses / n);
  const Misfit misfit = {sums.between / (own + shared), n - kOfEllipse, shared / own};
  return ExpectedScale(&misfit, 1, noise.spread, kMost);
}

}  // namespace circline
