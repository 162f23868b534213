#include "circline/ransac/conic_weights.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "circline/estimators/basics.h"

namespace circline {
namespace {

// Points per pixel of distance, by sector.
struct SectorDensities {
  std::array<double, kConicSectors> curve, background;
};

// For each sector the sum over it and `reach` neighbours on either side.
std::array<double, kConicSectors> SumsOfWindows(const std::array<double, kConicSectors>& counts,
                                                int reach) {
  std::array<double, kConicSectors> sums{};
  for (int k = 0; k < kConicSectors; ++k) {
    for (int j = k - reach; j <= k + reach; ++j) {
      sums[static_cast<std::size_t>(k)] +=
          counts[static_cast<std::size_t>((j + kConicSectors) % kConicSectors)];
    }
  }
  return sums;
}

// Points within the threshold of the ellipse whose directions fit, and points beside it (up to
// three times as far), by sector; fills what `result` keeps of each point.
struct SectorCounts {
  std::array<double, kConicSectors> inside{}, beside{};
};

SectorCounts CountSectors(const ConicModel& model, const ConicModel::Value& value, double threshold,
                          ConicWeights* result) {
  const std::size_t n = static_cast<std::size_t>(model.NumData());
  const ConicSectors sector_of(value);
  SectorCounts counts;
  result->squared_distances.resize(n);
  model.SquaredDistances(value, 0, model.NumData(), result->squared_distances.data());
  result->direction_residuals.resize(n);
  result->sectors.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    const int datum = static_cast<int>(i);
    const double r2 = static_cast<double>(result->squared_distances[i]);
    if (!(r2 <= 9.0 * threshold * threshold)) continue;
    const std::size_t k = sector_of(model.Position(datum));
    result->sectors[i] = static_cast<std::uint8_t>(k);
    if (r2 > threshold * threshold) {
      counts.beside[k] += 1.0;
      continue;
    }
    result->direction_residuals[i] = model.DirectionMiss(value, datum);
    if (result->direction_residuals[i] < kInlierSigmas * kInlierSigmas) counts.inside[k] += 1.0;
  }
  return counts;
}

// In each sector, of the points inside the threshold: those of the background, of which the share
// `chance` has a direction that fits, and those of the curve as far as they are sure (lower by
// three standard deviations of the background).
SectorDensities Densities(const SectorCounts& counts, double threshold, double chance,
                          double sigma) {
  constexpr int kReach = 2;  // Neighbours on each side that vouch for a sector.
  const std::array<double, kConicSectors> in = SumsOfWindows(counts.inside, kReach);
  const std::array<double, kConicSectors> near = SumsOfWindows(counts.beside, kReach);
  // What clutter all around leaves in a window; a blob at one place is not all around. The half
  // keeps a trace of doubt where none was seen.
  const double all_beside = std::accumulate(counts.beside.begin(), counts.beside.end(), 0.5);
  std::array<double, kConicSectors> sorted = near;
  std::nth_element(sorted.begin(), sorted.begin() + kConicSectors / 2, sorted.end());
  const double all_around = std::min(all_beside * (2.0 * kReach + 1.0) / kConicSectors,
                                     2.0 * sorted[kConicSectors / 2] + 1.0);
  SectorDensities densities;
  for (std::size_t k = 0; k < kConicSectors; ++k) {
    // Half local, half global; the sides are twice as wide as the inside.
    const double expected = 0.5 * (0.5 * near[k] + 0.5 * all_around);
    const double stray = chance * expected;
    densities.background[k] = expected / (2.0 * threshold);
    densities.curve[k] =
        std::max(0.0, in[k] - stray - 3.0 * std::sqrt(stray)) * 0.3989422804014327 / sigma;
  }
  return densities;
}

}  // namespace

double DirectionChance(const ConicModel& model) {
  if (!(model.sigma_rad() > 0.0)) return 1.0;
  return std::min(1.0, 2.0 * kInlierSigmas * model.sigma_rad() / kPi);
}

void WeighConic(const ConicModel& model, const ConicModel::Value& value, double threshold,
                ConicWeights* result) {
  const std::size_t n = static_cast<std::size_t>(model.NumData());
  const double s = result->sigma > 0.0 ? result->sigma : threshold / kInlierSigmas;
  // Density of the sine of the curve's own points where it is small over that of stray ones.
  const double sharpness = model.sigma_rad() > 0.0 ? std::sqrt(0.5 * kPi) / model.sigma_rad() : 1.0;
  const SectorDensities densities = Densities(CountSectors(model, value, threshold, result),
                                              threshold, DirectionChance(model), s);
  result->weights.assign(n, 0.0f);
  double sum = 0.0, sum_squares = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const double r2 = static_cast<double>(result->squared_distances[i]);
    if (!(r2 <= threshold * threshold)) continue;
    const std::size_t k = result->sectors[i];
    double density = densities.curve[k] * std::exp(-0.5 * r2 / (s * s));
    if (model.HasDirection(static_cast<int>(i))) {
      density *= sharpness * std::exp(-0.5 * result->direction_residuals[i]);
    }
    const double w = density / (density + densities.background[k]);
    result->weights[i] = static_cast<float>(w);
    sum += w;
    sum_squares += w * r2;
  }
  if (sum > ConicModel::kMinSamples + 1.0) {
    result->sigma = std::clamp(std::sqrt(sum_squares / (sum - ConicModel::kMinSamples)),
                               1e-3 * threshold, 0.5 * threshold);
  }
}

double ConicWeights::LogLikelihood() const {
  // w = curve / (curve + background).
  double sum = 0.0;
  for (const float w : weights) {
    if (w > 0.0f) sum -= std::log(std::max(1e-7, 1.0 - static_cast<double>(w)));
  }
  return sum;
}

}  // namespace circline
