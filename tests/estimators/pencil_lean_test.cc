#include "circline/estimators/pencil_lean.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <vector>

#include "circline/estimators/random.h"
#include "circline/estimators/vanishing_point.h"

namespace circline {
namespace {

constexpr double kVariance = kLeaning * kLeaning;

// Lines on walls, each wall seen at an angle to the right of the view's middle, radians, and
// leaning by its own two components across the vertical.
std::vector<LineFit> LinesOnWalls(const std::vector<double>& walls, double lean, Random* random) {
  std::vector<LineFit> lines;
  for (const double wall : walls) {
    const double x = lean * random->Normal(), z = lean * random->Normal();
    const Eigen::Vector3d vertical = Eigen::Vector3d(x, 1.0, z).normalized();
    for (int i = 0; i < 10; ++i) {
      const double at = wall + 0.01 * (i - 4.5);
      LineFit fit;
      fit.line = vertical.cross(Eigen::Vector3d(std::sin(at), 0.0, std::cos(at))).normalized();
      fit.covariance = 1e-8 * (Eigen::Matrix3d::Identity() - fit.line * fit.line.transpose());
      lines.push_back(fit);
    }
  }
  return lines;
}

PencilObservation Pencil(const std::vector<LineFit>& lines) {
  PencilObservation pencil;
  for (const LineFit& fit : lines) pencil.lines.push_back({{}, fit, {}});
  VanishingPointFit fit;
  EXPECT_TRUE(FitVanishingPoint(lines, &fit).ok());
  pencil.fit = fit;
  return pencil;
}

TEST(PencilLean, OneWallTurnsItsDirectionAsItLeans) {
  Random random(1);
  const PencilObservation pencil = Pencil(LinesOnWalls({0.2}, 0.0, &random));
  const Eigen::Vector3d v = pencil.fit->direction;
  const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - v * v.transpose();
  // Its lines are 0.09 rad apart, a third of what it takes to lean differently; wherever it stands
  // the fit makes no more of it than of a wall that is twisted by that.
  for (double at = -1.5; at < 1.5; at += 0.01) {
    const Eigen::Matrix3d shape = LeanShape(Pencil(LinesOnWalls({at}, 0.0, &random)));
    EXPECT_LT(shape.norm(), kVariance * (1.0 + 1.0 / (0.3 * 0.3)));
  }
  PencilObservation without_lines;
  without_lines.fit = pencil.fit;
  EXPECT_LT((LeanShape(without_lines) - kVariance * across).norm(), 1e-12);
}

// Two walls that lean apart look as if they converged: the direction tips towards the camera.
TEST(PencilLean, WallsLeftAndRightTipTheDirection) {
  const std::vector<double> walls = {-0.4, 0.4};
  constexpr double kLean = 0.004;
  constexpr int kDraws = 2000;
  double squares = 0.0;
  for (int draw = 0; draw < kDraws; ++draw) {
    Random random(static_cast<std::uint64_t>(draw) + 1);
    const Eigen::Vector3d v = Pencil(LinesOnWalls(walls, kLeaning * kLean, &random)).fit->direction;
    squares += std::pow(v.z() / v.y(), 2.0);
  }
  Random random(1);
  const Eigen::Matrix3d shape = LeanShape(Pencil(LinesOnWalls(walls, 0.0, &random)));
  EXPECT_NEAR(std::sqrt(squares / kDraws), kLean * std::sqrt(shape(2, 2)), 0.1 * kLean * 1.8);
  EXPECT_NEAR(std::sqrt(shape(2, 2)), kLeaning / (std::sqrt(2.0) * std::sin(0.4)), 0.15);
  EXPECT_NEAR(shape(0, 0), kVariance, 1e-6);  // The mean of two walls is no better than one.
}

}  // namespace
}  // namespace circline
