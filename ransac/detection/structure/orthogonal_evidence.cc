#include "circline/ransac/detection/structure/orthogonal_evidence.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "circline/estimators/basics.h"
#include "circline/estimators/noise_model.h"
#include "circline/ransac/detection/structure/uncertain_direction.h"
#include "circline/ransac/drifted_lines.h"

namespace circline {
namespace {

using Eigen::Vector3d;

// 7 to 1, the odds before that there is no such direction. Of 0, 1, 2 and 2.5, on simulated streets
// (seeds 11 to 13), turntable-teabox, and photos of streets and boxes at other sizes (structure.py;
// scene-lund-more and box-camprodon-more among them): below, more of these disagree, above, more
// streets have no second direction.
constexpr double kMinLogOdds = 2.0;
// A line so nearly orthogonal to the axis (a sine) has no direction orthogonal to it.
constexpr double kMinCross = 0.05;
// Turns about the axis that are compared, degrees: those of other houses' fronts are further off.
constexpr int kMostTurnDeg = 12;
// Leans, standard deviations, that stand for all.
constexpr int kMostLean = 2;

}  // namespace

OrthogonalEvidence::OrthogonalEvidence(const std::vector<LineFit>& lines, const Vector3d& axis,
                                       std::size_t num_along)
    : axis_(axis),
      drifted_for_each_(kDriftShare * static_cast<double>(num_along) /
                        std::max(1.0, static_cast<double>(lines.size()))) {
  for (const LineFit& line : lines) {
    const double lean = kRightAngleSigmaDeg * kDegree * line.line.dot(axis);
    lines_.emplace_back(WithDirectionError(line, std::hypot(kParallelSigmaRad, lean)));
  }
}

double OrthogonalEvidence::LogOdds(const Vector3d& direction) const {
  const Vector3d turn = axis_.cross(direction);
  double expected = 0.0, information = 0.0;
  std::vector<double> ratios;  // Of likelihoods, of the lines that may share the direction.
  for (const LineOdds& line : lines_) {
    const double variance = line.Variance(direction), sigma = std::sqrt(variance);
    // As many lines run this way by chance as if there were so many of any orientation for each.
    const double density = 1.0 + drifted_for_each_ * DriftRatio(line.middle(), axis_, direction);
    // Lines as near by chance.
    expected += density * 2.0 / kPi *
                std::asin(std::min(1.0, kInlierSigmas * sigma / line.Sine(direction)));
    const double slope = line.Residual(turn) / sigma;
    if (std::abs(line.Residual(direction)) > kInlierSigmas * sigma) continue;
    ratios.push_back(std::exp(line.LogRatio(direction, variance)) / density);
    information += slope * slope;
  }
  if (ratios.empty()) return -std::numeric_limits<double>::infinity();
  const double all = static_cast<double>(lines_.size()), near = static_cast<double>(ratios.size());
  const double share = std::max(0.5 * near, near - expected) / (all + 1.0);
  double log_odds = (all - near) * std::log(1.0 - share);
  for (const double ratio : ratios) log_odds += std::log(1.0 - share + share * ratio);
  // No wider than all angles: lines through the axis' own point say nothing of any.
  return log_odds + std::min(0.0, 0.5 * std::log(2.0 * kPi / information) - std::log(kPi));
}

std::vector<Vector3d> OrthogonalEvidence::Proposals() const {
  std::vector<Vector3d> proposals;
  for (const LineOdds& proposer : lines_) {
    const Vector3d cross = axis_.cross(proposer.fit().line);
    if (cross.norm() >= kMinCross) proposals.push_back(cross.normalized());
  }
  return proposals;
}

std::optional<Vector3d> OrthogonalEvidence::Best() const {
  std::optional<Vector3d> best;
  double best_odds = kMinLogOdds;
  for (const Vector3d& direction : Proposals()) {
    const double log_odds = LogOdds(direction);
    if (!(log_odds > best_odds)) continue;
    best_odds = log_odds;
    best = direction;
  }
  return best;
}

double OrthogonalEvidence::HighestLogOdds() const {
  double highest = -std::numeric_limits<double>::infinity();
  for (const Vector3d& direction : Proposals()) {
    const double third = LogOdds(axis_.cross(direction));
    highest = std::max(highest, LogOdds(direction) + std::log(0.5 + 0.5 * std::exp(third)));
  }
  return highest - kMinLogOdds;
}

std::vector<DirectionReading> ReadDirection(const std::vector<LineFit>& lines, const Vector3d& axis,
                                            const Vector3d& direction, int num_own) {
  const double odds = num_own / (static_cast<double>(lines.size()) + 1.0 - num_own);
  const double lean_rad = kRightAngleSigmaDeg * kDegree;
  const double reach =
      std::sin(kMostTurnDeg * kDegree + kMostLean * lean_rad) + kInlierSigmas * kParallelSigmaRad;
  std::vector<LineOdds> near;
  for (const LineFit& line : lines) {
    if (std::abs(line.line.dot(direction)) < reach)
      near.emplace_back(WithDirectionError(line, kParallelSigmaRad));
  }
  const Vector3d level = axis.cross(direction).cross(axis).normalized(), aside = axis.cross(level);
  std::vector<DirectionReading> readings;
  Eigen::ArrayXXd logs(2 * kMostLean + 1, 2 * kMostTurnDeg + 1);  // Of the likelihoods.
  for (int turn = -kMostTurnDeg; turn <= kMostTurnDeg; ++turn) {
    const Vector3d turned = std::cos(turn * kDegree) * level + std::sin(turn * kDegree) * aside;
    readings.push_back({turned, 0.0});
    for (int lean = -kMostLean; lean <= kMostLean; ++lean) {
      const Vector3d v = std::cos(lean * lean_rad) * turned + std::sin(lean * lean_rad) * axis;
      double& sum = logs(lean + kMostLean, turn + kMostTurnDeg);
      sum = -0.5 * lean * lean;
      for (const LineOdds& line : near)
        sum += std::log1p(odds * std::exp(line.LogRatio(v, line.Variance(v))));
    }
  }
  const Eigen::ArrayXXd likelihoods = (logs - logs.maxCoeff()).exp();
  for (std::size_t k = 0; k < readings.size(); ++k) {
    readings[k].probability =
        likelihoods.col(static_cast<Eigen::Index>(k)).sum() / likelihoods.sum();
  }
  return readings;
}

}  // namespace circline
