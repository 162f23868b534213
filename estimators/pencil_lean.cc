#include "circline/estimators/pencil_lean.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "circline/estimators/basics.h"
#include "circline/estimators/directions.h"

namespace circline {
namespace {

// Angle about the direction, radians, over which leans become independent. On scene-lund,
// box-camprodon and boards, where 0.1 to 0.3 serve alike; scene-lund-more, box-camprodon-more and
// circles-robot10x10 had no part in it.
constexpr double kWallRad = 0.3;
constexpr int kSectors = 32;  // Of half a turn: narrow against a wall.

}  // namespace

Eigen::Matrix3d LeanShape(const PencilObservation& pencil) {
  constexpr double kVariance = kLeaning * kLeaning;
  if (!pencil.fit) return kVariance * Eigen::Matrix3d::Identity();
  const Eigen::Vector3d v = pencil.fit->direction;
  const Eigen::Matrix<double, 3, 2> across = BasisAcross(v);
  const Eigen::Matrix3d one_wall = kVariance * across * across.transpose();
  // Of each sector's lines: a line of normal n and variance s^2 measures n . v.
  struct Sector {
    Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
    double turns = 0.0;  // Sum over information, of half turns: n has no sense.
  };
  std::array<Sector, kSectors> sectors;
  for (const LineObservation& line : pencil.lines) {
    if (!line.fit || !line.is_parallel) continue;
    const Eigen::Vector2d n = across.transpose() * line.fit->line;
    const double variance = v.dot(line.fit->covariance * v), angle = std::atan2(n.y(), n.x()) / kPi;
    if (!(variance > 0.0) || !std::isfinite(angle)) continue;
    const double turn = angle - std::floor(angle);
    const int index = std::clamp(static_cast<int>(turn * kSectors), 0, kSectors - 1);
    Sector& sector = sectors[static_cast<std::size_t>(index)];
    sector.information += n * n.transpose() / variance;
    sector.turns += n.squaredNorm() / variance * turn;
  }
  Eigen::Matrix2d all = Eigen::Matrix2d::Zero(), turned = Eigen::Matrix2d::Zero();
  for (const Sector& a : sectors) {
    if (a.information.isZero(0.0)) continue;
    all += a.information;
    for (const Sector& b : sectors) {
      if (b.information.isZero(0.0)) continue;
      // Between their middles, so that lines on either side of a border count as near.
      const double apart =
          std::abs(a.turns / a.information.trace() - b.turns / b.information.trace());
      const double walls = kPi * std::min(apart, 1.0 - apart) / kWallRad;
      turned += std::exp(-0.5 * walls * walls) * a.information * b.information;
    }
  }
  // Lines side by side tell nothing of a second wall.
  constexpr double kNarrow = 1e-6;
  if (!(all.determinant() > kNarrow * all.trace() * all.trace())) return one_wall;
  const Eigen::Matrix2d inverse = all.inverse();
  // Walls of one street also lean together: the mean of many is no better than one.
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen;
  eigen.computeDirect(inverse * turned * inverse);
  const Eigen::Matrix2d shape = eigen.eigenvectors() *
                                eigen.eigenvalues().cwiseMax(1.0).asDiagonal() *
                                eigen.eigenvectors().transpose();
  return kVariance * across * shape * across.transpose();
}

}  // namespace circline
