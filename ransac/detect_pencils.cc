#include "circline/ransac/detect_pencils.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

#include "circline/ransac/pencil_model.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Lines that are parallel in space miss their common direction by more than edges explain: in old
// streets and on hand-made things by a third of a degree. The search allows for this much, the fit
// then estimates how much it is, but not below what lens and calibration leave. Radians.
constexpr double kSearchSigmaRad = 3e-3;
constexpr double kExactSigmaRad = 5e-4;
constexpr double kMinSpreadRad = 2e-4;

// The standard deviation (radians) by which lines miss the direction beyond what their own
// covariances explain: chosen so that half of the total length has normalised residuals below the
// median of a Gaussian's. Between kMinSpreadRad and kSearchSigmaRad.
double EstimateSpread(const std::vector<DetectedLine>& lines, const std::vector<int>& members,
                      const Vector3d& direction) {
  const auto share_below = [&](double spread) {
    double below = 0.0, total = 0.0;
    for (const int i : members) {
      const DetectedLine& line = lines[static_cast<std::size_t>(i)];
      const double miss = line.fit.line.dot(direction);
      const double variance = direction.dot(line.fit.covariance * direction) + spread * spread;
      total += line.length_px;
      if (miss * miss < 0.455 * variance) below += line.length_px;
    }
    return below / total;
  };
  double low = kMinSpreadRad, high = kSearchSigmaRad;
  if (share_below(low) >= 0.5) return low;
  if (share_below(high) <= 0.5) return high;
  for (int step = 0; step < 12; ++step) {  // To a part in 4000 of the interval.
    const double middle = 0.5 * (low + high);
    (share_below(middle) < 0.5 ? low : high) = middle;
  }
  return high;
}

// Moves the direction to where the pencil's lines are densest, if most of them are exactly
// parallel.
void StartAtDensest(const std::vector<DetectedLine>& lines, const PencilOptions& options,
                    FoundPencil* pencil) {
  std::vector<LineFit> members;
  for (const int i : pencil->lines) members.push_back(lines[static_cast<std::size_t>(i)].fit);
  PencilOptions exact = options;
  exact.model_sigma_rad = kExactSigmaRad;
  VanishingPointFit fit;
  if (FitVanishingPointRobust(members, exact, &fit).ok()) pencil->fit = fit;
}

// The search finds what roughly shares a direction. Here the scatter of its lines about it is
// estimated, those beyond it are dropped and the direction is fitted to the rest, each line with
// its own covariance and the common scatter: the lines of a printed board all count for what they
// were measured, those of an old street, each a third of a degree from parallel, count alike. No
// line is left where nothing fits.
void RefitPencil(const std::vector<DetectedLine>& lines, const PencilOptions& options,
                 FoundPencil* pencil) {
  const std::vector<int> all = pencil->lines;
  double spread = kSearchSigmaRad;
  StartAtDensest(lines, options, pencil);
  constexpr int kPasses = 5;
  for (int pass = 0; pass < kPasses; ++pass) {
    spread = std::min(spread, EstimateSpread(lines, pencil->lines, pencil->fit.direction));
    pencil->lines.clear();
    std::vector<LineFit> fits;
    for (const int i : all) {
      LineFit line = lines[static_cast<std::size_t>(i)].fit;
      line.covariance +=
          spread * spread * (Matrix3d::Identity() - line.line * line.line.transpose());
      const double r = VanishingPointResidual(line, pencil->fit.direction);
      if (std::abs(r) > options.ransac.threshold) continue;
      fits.push_back(line);
      pencil->lines.push_back(i);
    }
    VanishingPointFit fit;
    if (!FitVanishingPoint(fits, &fit).ok()) {
      pencil->lines.clear();
      break;
    }
    pencil->fit = fit;
  }
}

// Of (value, weight) pairs, which it sorts; 0 for none.
double WeightedMedian(std::vector<std::pair<double, double>>* values) {
  std::sort(values->begin(), values->end());
  double total = 0.0, sum = 0.0;
  for (const auto& [value, weight] : *values) total += weight;
  for (const auto& [value, weight] : *values) {
    sum += weight;
    if (sum >= 0.5 * total) return value;
  }
  return 0.0;
}

DetectedPencil MakePencil(const FoundPencil& found, const std::vector<DetectedLine>& lines) {
  DetectedPencil pencil;
  pencil.observation.fit = found.fit;
  double variance = 0.0, points = 0.0;
  std::vector<std::pair<double, double>>
      excess;  // Squared sigma that explains a line's miss; length.
  for (const int i : found.lines) {
    const DetectedLine& line = lines[static_cast<std::size_t>(i)];
    LineObservation observation;
    observation.points = line.points;
    observation.fit = line.fit;
    pencil.observation.lines.push_back(std::move(observation));
    const double n = static_cast<double>(line.points.size());
    variance += n * line.sigma_px * line.sigma_px;
    points += n;
    const double r = VanishingPointResidual(line.fit, found.fit.direction) * line.sigma_px;
    excess.emplace_back(r * r, line.length_px);
    pencil.ends.push_back(line.ends);
    pencil.support_px += line.length_px;
  }
  // Points of lines that are not quite parallel are no better than their lines' scatter. 0.455 is
  // the median of the square of a standard Gaussian.
  const double scatter = WeightedMedian(&excess) / 0.455;
  pencil.observation.sigma_px = std::sqrt(std::max(variance / std::max(points, 1.0), scatter));
  return pencil;
}

}  // namespace

Status DetectPencils(const std::vector<DetectedLine>& lines, int max_pencils, std::uint64_t seed,
                     std::vector<DetectedPencil>* pencils) {
  pencils->clear();
  std::vector<LineFit> fits;
  for (const DetectedLine& line : lines) fits.push_back(line.fit);
  PencilOptions pencil_options;
  pencil_options.ransac.seed = seed;
  pencil_options.model_sigma_rad = kSearchSigmaRad;
  pencil_options.max_pencils = max_pencils;
  std::vector<FoundPencil> found;
  const Status status = FindPencils(fits, pencil_options, &found);
  if (!status.ok()) return status;
  for (FoundPencil& f : found) {
    RefitPencil(lines, pencil_options, &f);
    if (static_cast<int>(f.lines.size()) < pencil_options.min_lines) continue;
    pencils->push_back(MakePencil(f, lines));
  }
  std::stable_sort(
      pencils->begin(), pencils->end(),
      [](const DetectedPencil& a, const DetectedPencil& b) { return a.support_px > b.support_px; });
  return Status::Ok();
}

}  // namespace circline
