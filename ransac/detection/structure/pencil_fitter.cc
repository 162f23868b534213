#include "circline/ransac/detection/structure/pencil_fitter.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace circline {
namespace {

using Eigen::Vector3d;

// Lines of one thing may bend or be badly printed: the fit allows for more than the search where
// they are known to be, and estimates how much it is, but not below what lens and calibration
// leave. Radians.
constexpr double kExactSigmaRad = 5e-4;
constexpr double kMinSpreadRad = 2e-4;
constexpr double kMaxSpreadRad = 12e-3;
// What all points of a line share, pixels: no number of them averages it out. It turns short lines
// by more than long ones; measured on the sides of chessboard squares.
constexpr double kSharedErrorPx = 0.06;

double Variance(const LineFit& line, const Vector3d& direction, double spread) {
  return direction.dot(line.covariance * direction) + spread * spread;
}

std::vector<int> LinesNear(const LineSet& set, const std::vector<int>& candidates,
                           const Vector3d& direction, double spread) {
  std::vector<int> near;
  for (const int i : candidates) {
    const LineFit& line = set.fits[static_cast<std::size_t>(i)];
    const double residual = line.line.dot(direction);
    if (residual * residual <= kInlierSigmas * kInlierSigmas * Variance(line, direction, spread))
      near.push_back(i);
  }
  return near;
}

// The standard deviation (radians) by which lines miss the direction beyond what their own
// covariances explain: chosen so that half of the total length has normalised residuals below the
// median of a Gaussian's. Between kMinSpreadRad and the largest.
double EstimateSpread(const LineSet& set, const std::vector<int>& members,
                      const Vector3d& direction, double max_spread) {
  const auto share_below = [&](double spread) {
    double below = 0.0, total = 0.0;
    for (const int i : members) {
      const LineFit& line = set.fits[static_cast<std::size_t>(i)];
      const double residual = line.line.dot(direction);
      const double length = set.lines[static_cast<std::size_t>(i)].length_px;
      total += length;
      if (residual * residual < 0.455 * Variance(line, direction, spread)) below += length;
    }
    return below / std::max(total, 1.0);
  };
  double low = kMinSpreadRad, high = max_spread;
  if (share_below(low) >= 0.5) return low;
  if (share_below(high) <= 0.5) return high;
  for (int step = 0; step < 12; ++step) {  // To a part in 4000 of the interval.
    const double middle = 0.5 * (low + high);
    (share_below(middle) < 0.5 ? low : high) = middle;
  }
  return high;
}

}  // namespace

LineSet::LineSet(const std::vector<DetectedLine>& detected, double photo_px)
    : lines(detected), diagonal_px(photo_px), twin_of(FindTwins(detected, photo_px)) {
  for (const DetectedLine& line : lines) fits.push_back(WithSharedError(line, kSharedErrorPx));
}

int LineSet::Count(const std::vector<int>& members) const {
  return static_cast<int>(
      std::count_if(members.begin(), members.end(), [this](int i) { return !IsTwin(i); }));
}

std::optional<DetectedPencil> FitPencil(const LineSet& set, const std::vector<int>& candidates,
                                        const Vector3d& direction, double max_spread_rad,
                                        int min_lines) {
  constexpr int kPasses = 6;
  VanishingPointFit fit;
  fit.direction = direction;
  std::vector<int> members;
  std::vector<LineFit> fits;
  for (int pass = 0; pass < kPasses; ++pass) {
    const std::vector<int> near = LinesNear(set, candidates, fit.direction, max_spread_rad);
    const double spread = EstimateSpread(set, near, fit.direction, max_spread_rad);
    members = LinesNear(set, near, fit.direction, spread);
    fits.clear();
    for (const int i : members)
      fits.push_back(WithDirectionError(set.fits[static_cast<std::size_t>(i)], spread));
    if (!FitVanishingPoint(fits, &fit).ok()) return std::nullopt;
  }
  if (set.Count(members) < min_lines) return std::nullopt;
  DetectedPencil pencil = MakePencil(set.lines, members, fits, fit.direction);
  pencil.observation.fit = fit;
  return pencil;
}

Vector3d DensestDirection(const LineSet& set, const std::vector<int>& lines,
                          const Vector3d& direction, std::uint64_t seed) {
  std::vector<LineFit> members;
  for (const int i : lines) members.push_back(set.fits[static_cast<std::size_t>(i)]);
  PencilOptions exact;
  exact.ransac.seed = seed;
  exact.model_sigma_rad = kExactSigmaRad;
  exact.max_pencils = 1;
  exact.max_false_alarms = 1e300;  // However few they are.
  std::vector<FoundPencil> densest;
  const bool is_found = FindPencils(members, exact, &densest).ok() && !densest.empty();
  return is_found ? densest.front().fit.direction : direction;
}

bool RefitPencil(const LineSet& set, const std::vector<int>& candidates, DetectedPencil* pencil) {
  std::optional<DetectedPencil> found =
      FitPencil(set, candidates, pencil->observation.fit->direction, kMaxSpreadRad, 1);
  if (!found) return false;
  *pencil = std::move(*found);
  return true;
}

DetectedPencil MakePencil(const std::vector<DetectedLine>& lines, const std::vector<int>& members,
                          const std::vector<LineFit>& fits, const Vector3d& direction) {
  DetectedPencil pencil;
  pencil.members = members;
  double variance = 0.0, points = 0.0;
  for (std::size_t k = 0; k < members.size(); ++k) {
    const DetectedLine& line = lines[static_cast<std::size_t>(members[k])];
    LineObservation observation;
    observation.points = line.points;
    observation.fit = line.fit;
    // Points of lines that are not quite parallel are no better than the lines.
    const double widening = direction.dot(fits[k].covariance * direction) /
                            direction.dot(line.fit.covariance * direction);
    observation.sigma_px = line.sigma_px * std::sqrt(widening);
    observation.fit->covariance *= widening;
    const double n = static_cast<double>(line.points.size());
    variance += n * line.sigma_px * line.sigma_px;
    points += n;
    pencil.observation.lines.push_back(std::move(observation));
    pencil.ends.push_back(line.ends);
    pencil.support_px += line.length_px;
  }
  pencil.observation.sigma_px = std::sqrt(variance / std::max(points, 1.0));
  return pencil;
}

void FitAlone(DetectedPencil* pencil) {
  std::vector<LineFit> fits;
  for (const LineObservation& line : pencil->observation.lines) fits.push_back(*line.fit);
  VanishingPointFit fit;
  if (FitVanishingPoint(fits, &fit).ok()) pencil->observation.fit = fit;
}

}  // namespace circline
