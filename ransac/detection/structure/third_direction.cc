#include "circline/ransac/detection/structure/third_direction.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "circline/estimators/basics.h"
#include "circline/estimators/directions.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// Directions are summed over so many steps to either side, of so many standard deviations.
constexpr int kSteps = 4;
constexpr double kStep = 0.6;
// Lines further from a direction, in standard deviations, are not along it.
constexpr double kFar = 4.0;
// A line along a direction says no more: products of many stay finite.
constexpr double kMostLogRatio = 10.0;
// Gauss and Legendre's points for the share of the lines, and their weights.
constexpr std::array<double, 3> kShares = {0.1127016654, 0.5, 0.8872983346};
constexpr std::array<double, 3> kWeights = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};

// Lines along the third direction are so much likelier so than any way: fewer tell nothing. Of 20,
// 5 and 2, on simulated streets of guessed cameras (seeds 1 to 3).
constexpr double kLeastRatio = 5.0;

double Ratio(const LineOdds& line, const Vector3d& direction) {
  const double residual = line.Residual(direction), variance = line.Variance(direction);
  if (residual * residual > kFar * kFar * variance) return 0.0;
  return std::exp(std::min(line.LogRatio(direction, variance), kMostLogRatio));
}

double RatioAt(const std::vector<LineOdds>& lines, const Vector3d& direction) {
  std::array<double, 3> products = {1.0, 1.0, 1.0};
  for (const LineOdds& line : lines) {
    const double ratio = Ratio(line, direction);
    for (std::size_t k = 0; k < 3; ++k) products[k] *= 1.0 - kShares[k] + kShares[k] * ratio;
  }
  double sum = 0.0;
  for (std::size_t k = 0; k < 3; ++k) sum += kWeights[k] * products[k];
  return sum;
}

}  // namespace

std::optional<UncertainDirection> ThirdDirection(const UncertainDirection& a,
                                                 const UncertainDirection& b,
                                                 const CameraError& camera) {
  UncertainDirection third;
  if (!SpannedNormal(a, b, &third)) return std::nullopt;
  const double lean = std::hypot(kRightAngleSigmaDeg * kDegree, camera.middle_rad);
  third.covariance +=
      lean * lean * (Matrix3d::Identity() - third.direction * third.direction.transpose());
  return third;
}

SharedDirection LinesAlong(const std::vector<LineOdds>& lines, const UncertainDirection& expected) {
  const Eigen::Matrix<double, 3, 2> basis = BasisAcross(expected.direction);
  const Eigen::Matrix2d root =
      (basis.transpose() * expected.covariance * basis).eval().llt().matrixL();
  SharedDirection shared;
  double highest = 0.0, all = 0.0;
  for (int x = -kSteps; x <= kSteps; ++x) {
    for (int y = -kSteps; y <= kSteps; ++y) {
      const Vector2d off = kStep * Vector2d(x, y);
      const Vector3d direction = (expected.direction + basis * (root * off)).normalized();
      const double weight = std::exp(-0.5 * off.squaredNorm());
      const double ratio = weight * RatioAt(lines, direction);
      shared.ratio += ratio;
      all += weight;
      if (ratio <= highest) continue;
      highest = ratio;
      shared.direction = direction;
    }
  }
  shared.ratio /= all;
  return shared;
}

std::optional<ThirdPencil> FindThirdPencil(const LineSet& set, const PlacedPencil& a,
                                           const PlacedPencil& b, const CameraError& camera) {
  const auto third = ThirdDirection(a.along, b.along, camera);
  if (!third) return std::nullopt;
  std::vector<int> others;
  std::vector<LineOdds> odds;
  for (int i = 0; i < static_cast<int>(set.lines.size()); ++i) {
    if (a.Has(i) || b.Has(i)) continue;
    others.push_back(i);
    const LineFit& fit = set.fits[static_cast<std::size_t>(i)];
    if (!set.IsTwin(i)) odds.emplace_back(WithDirectionError(fit, kParallelSigmaRad));
  }
  const SharedDirection shared = LinesAlong(odds, *third);
  if (!(shared.ratio > kLeastRatio)) return std::nullopt;
  auto pencil =
      FitPencil(set, others, shared.direction, kParallelSigmaRad, PencilOptions().min_lines);
  if (!pencil) return std::nullopt;
  return ThirdPencil{std::move(*pencil), shared.ratio};
}

}  // namespace circline
