#include "circline/ransac/detection/direction_readings.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "circline/estimators/basics.h"
#include "circline/ransac/detection/line_odds.h"
#include "circline/ransac/detection/uncertain_direction.h"

namespace circline {
namespace {

using Eigen::Vector3d;

// Turns about the axis that are compared, degrees: those of other houses' fronts are further off.
constexpr int kMostTurnDeg = 12;
// Leans, standard deviations, that stand for all.
constexpr double kLeans[] = {-2.0, -1.0, 0.0, 1.0, 2.0};
// Less likely a line is along a direction no more.
constexpr double kNegligible = -20.0;

}  // namespace

std::vector<DirectionReading> ReadDirection(const std::vector<LineFit>& lines, const Vector3d& axis,
                                            const Vector3d& direction, int num_own) {
  const double share = num_own / (static_cast<double>(lines.size()) + 1.0);
  const double reach = std::sin((kMostTurnDeg + 2.0 * kRightAngleSigmaDeg) * kDegree) +
                       kInlierSigmas * kParallelSigmaRad;
  std::vector<LineOdds> near;
  for (const LineFit& line : lines) {
    if (std::abs(line.line.dot(direction)) < reach)
      near.emplace_back(WithDirectionError(line, kParallelSigmaRad));
  }
  const auto log_likelihood = [&](const Vector3d& v) {
    double sum = 0.0;
    for (const LineOdds& line : near) {
      const double ratio = line.LogRatio(v, line.Variance(v));
      if (ratio > kNegligible) sum += std::log1p(share / (1.0 - share) * std::exp(ratio));
    }
    return sum;
  };
  const Vector3d level = axis.cross(direction).cross(axis).normalized(), aside = axis.cross(level);
  std::vector<double> logs;
  for (int turn = -kMostTurnDeg; turn <= kMostTurnDeg; ++turn) {
    const Vector3d turned = std::cos(turn * kDegree) * level + std::sin(turn * kDegree) * aside;
    for (const double lean : kLeans) {
      const double angle = lean * kRightAngleSigmaDeg * kDegree;
      logs.push_back(log_likelihood(std::cos(angle) * turned + std::sin(angle) * axis) -
                     0.5 * lean * lean);
    }
  }
  const double most = *std::max_element(logs.begin(), logs.end());
  std::vector<DirectionReading> readings;
  double sum = 0.0;
  for (std::size_t k = 0; k < logs.size(); ++k) {
    if (k % std::size(kLeans) == 0) {
      const double turn = (static_cast<int>(k / std::size(kLeans)) - kMostTurnDeg) * kDegree;
      readings.push_back({std::cos(turn) * level + std::sin(turn) * aside, 0.0});
    }
    readings.back().probability += std::exp(logs[k] - most);
    sum += std::exp(logs[k] - most);
  }
  for (DirectionReading& reading : readings) reading.probability /= sum;
  return readings;
}

}  // namespace circline
