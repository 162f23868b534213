#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

#include "circline/refine/track/track_steps.h"

namespace circline {
namespace {

// Whether two fits of a frame are one minimum, or so near that it does not matter.
bool IsSame(const TrackMap& map, const TrackState& a, const TrackState& b) {
  constexpr double kSame = 0.25;  // Half a standard deviation of both.
  return SquaredDistance(a.Pose(map), b.Pose(map), a.PoseCovariance(map) + b.PoseCovariance(map)) <
         kSame;
}

// Log weights to log probabilities.
void Normalize(Kept<TrackFit>* fits) {
  double most = -std::numeric_limits<double>::infinity(), sum = 0.0;
  for (const TrackFit& fit : *fits) most = std::max(most, fit.state.log_weight);
  for (const TrackFit& fit : *fits) sum += std::exp(fit.state.log_weight - most);
  for (TrackFit& fit : *fits) fit.state.log_weight -= most + std::log(sum);
}

}  // namespace

void Merge(const TrackMap& map, Kept<TrackFit>* fits) {
  std::size_t merged = 0;  // The first ones are different.
  for (TrackFit& fit : *fits) {
    std::size_t same = 0;
    while (same < merged && !IsSame(map, fit.state, (*fits)[same].state)) ++same;
    if (same == merged) {
      std::swap((*fits)[merged++], fit);
      continue;
    }
    TrackFit& other = (*fits)[same];
    if (fit.state.log_weight > other.state.log_weight) std::swap(other, fit);
  }
  fits->Shorten(merged);
}

void Rank(const TrackerOptions& options, Kept<TrackFit>* fits) {
  Normalize(fits);
  const auto is_more = [](const TrackFit& a, const TrackFit& b) {
    return a.state.log_weight > b.state.log_weight;
  };
  const auto best = std::min_element(fits->begin(), fits->end(), is_more);
  if (best->state.log_weight > fits->begin()->state.log_weight + std::log(options.flip_odds))
    std::rotate(fits->begin(), best, best + 1);
  // Few: by insertion, which keeps the order of equals and needs no memory.
  for (auto one = fits->begin() + 1; one < fits->end(); ++one)
    std::rotate(std::upper_bound(fits->begin() + 1, one, *one, is_more), one, one + 1);
  const double least = std::log(options.min_probability);
  const auto most = static_cast<std::size_t>(options.max_hypotheses);
  std::size_t kept = 0;
  for (TrackFit& fit : *fits) {
    if (kept == 0 || (kept < most && fit.state.log_weight >= least))
      std::swap((*fits)[kept++], fit);
  }
  fits->Shorten(kept);
  Normalize(fits);
}

}  // namespace circline
