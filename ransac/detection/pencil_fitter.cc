#include "circline/ransac/detection/pencil_fitter.h"

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

}  // namespace

LineSet::LineSet(const std::vector<DetectedLine>& detected, double photo_px)
    : lines(detected), diagonal_px(photo_px), twin_of(FindTwins(detected, photo_px)) {
  for (const DetectedLine& line : lines) fits.push_back(WithSharedError(line, kSharedErrorPx));
}

int LineSet::Count(const std::vector<int>& members) const {
  return static_cast<int>(
      std::count_if(members.begin(), members.end(), [this](int i) { return !IsTwin(i); }));
}

bool PencilFitter::Fit(const std::vector<int>& candidates, FoundPencil* pencil,
                       double* spread) const {
  *spread = max_spread_;
  constexpr int kPasses = 6;
  for (int pass = 0; pass < kPasses; ++pass) {
    const Vector3d direction = pencil->fit.direction;
    const std::vector<int> near = Near(candidates, direction, max_spread_);
    *spread = EstimateSpread(near, direction);
    pencil->lines = Near(near, direction, *spread);
    std::vector<LineFit> members;
    for (const int i : pencil->lines) members.push_back(WithDirectionError(Line(i), *spread));
    VanishingPointFit fit;
    if (!FitVanishingPoint(members, &fit).ok()) return false;
    pencil->fit = fit;
  }
  return true;
}

void PencilFitter::StartAtDensest(std::uint64_t seed, FoundPencil* pencil) const {
  std::vector<LineFit> members;
  for (const int i : pencil->lines) members.push_back(Line(i));
  PencilOptions exact;
  exact.ransac.seed = seed;
  exact.model_sigma_rad = kExactSigmaRad;
  exact.max_pencils = 1;
  exact.max_false_alarms = 1e300;  // However few they are.
  std::vector<FoundPencil> densest;
  if (FindPencils(members, exact, &densest).ok() && !densest.empty())
    pencil->fit = densest.front().fit;
}

double PencilFitter::Variance(int i, const Vector3d& direction, double spread) const {
  return direction.dot(Line(i).covariance * direction) + spread * spread;
}

std::vector<int> PencilFitter::Near(const std::vector<int>& candidates, const Vector3d& direction,
                                    double spread) const {
  std::vector<int> near;
  for (const int i : candidates) {
    const double miss = Line(i).line.dot(direction);
    if (miss * miss <= kInlierSigmas * kInlierSigmas * Variance(i, direction, spread))
      near.push_back(i);
  }
  return near;
}

// The standard deviation (radians) by which lines miss the direction beyond what their own
// covariances explain: chosen so that half of the total length has normalised residuals below the
// median of a Gaussian's. Between kMinSpreadRad and the largest.
double PencilFitter::EstimateSpread(const std::vector<int>& members,
                                    const Vector3d& direction) const {
  const auto share_below = [&](double spread) {
    double below = 0.0, total = 0.0;
    for (const int i : members) {
      const double miss = Line(i).line.dot(direction);
      const double length = set_.lines[static_cast<std::size_t>(i)].length_px;
      total += length;
      if (miss * miss < 0.455 * Variance(i, direction, spread)) below += length;
    }
    return below / std::max(total, 1.0);
  };
  double low = kMinSpreadRad, high = max_spread_;
  if (share_below(low) >= 0.5) return low;
  if (share_below(high) <= 0.5) return high;
  for (int step = 0; step < 12; ++step) {  // To a part in 4000 of the interval.
    const double middle = 0.5 * (low + high);
    (share_below(middle) < 0.5 ? low : high) = middle;
  }
  return high;
}

DetectedPencil MakePencil(const FoundPencil& found, const LineSet& set, double spread) {
  std::vector<LineFit> fits;
  for (const int i : found.lines) {
    fits.push_back(WithDirectionError(set.fits[static_cast<std::size_t>(i)], spread));
  }
  DetectedPencil pencil = MakePencil(set.lines, found.lines, fits, found.fit.direction);
  pencil.observation.fit = found.fit;
  return pencil;
}

bool RefitPencil(const std::vector<DetectedLine>& lines, const std::vector<int>& candidates,
                 DetectedPencil* pencil, double diagonal_px) {
  const LineSet set(lines, diagonal_px);
  FoundPencil found;
  found.fit = *pencil->observation.fit;
  double spread;
  if (!PencilFitter(set, kMaxSpreadRad).Fit(candidates, &found, &spread)) return false;
  *pencil = MakePencil(found, set, spread);
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

}  // namespace circline
