#include "circline/ransac/detection/structure/line_odds.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "circline/estimators/basics.h"
#include "circline/ransac/drifted_lines.h"

namespace circline {
namespace {

constexpr double kLeastSine = 1e-3;  // The middle of a line is not known to better.

}  // namespace

LineOdds::LineOdds(const LineFit& fit) : fit_(fit), middle_(MiddleOf(fit)) {}

double LineOdds::Sine(const Eigen::Vector3d& direction) const {
  return std::clamp(middle_.cross(direction).norm() / direction.norm(), kLeastSine, 1.0);
}

// A line of any orientation, an angle phi uniform, misses by sine * cos(phi): with a density of
// 1 / (pi sine) at no miss, and hardly more near it.
double LineOdds::LogRatio(const Eigen::Vector3d& direction, double variance) const {
  const double sine = Sine(direction), residual = Residual(direction);
  return 0.5 * std::log(0.5 * kPi * sine * sine / variance) - 0.5 * residual * residual / variance;
}

}  // namespace circline
