#include "circline/refine/track_ranking.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <utility>

namespace circline {
namespace {

// Whether two fits of a frame are one minimum, or so near that it does not matter: the squared
// distance of their poses under both covariances.
bool IsSame(const TrackMap& map, const TrackFit& a, const TrackFit& b) {
  constexpr double kSame = 0.25;  // Half a standard deviation.
  const CameraPose p = a.state.Pose(map), q = b.state.Pose(map);
  const int size = map.tangent(TrackMap::kTurnRate);
  BlockMatrix e(size, 1), root = a.state.covariance.topLeftCorner(size, size) +
                                 b.state.covariance.topLeftCorner(size, size);
  e.topRows<3>() = LogRotation(p.rotation.transpose() * q.rotation);
  if (size == 6) e.bottomRows<3>() = q.translation - p.translation;
  if (!FactorInPlace(root)) return false;
  HalfSolveInPlace(root, e);
  return e.squaredNorm() < kSame;
}

double LogAdd(double a, double b) {
  if (std::isinf(a)) return b;
  return std::max(a, b) + std::log1p(std::exp(-std::abs(a - b)));
}

double LogWeight(const TrackState& state) { return state.log_weight; }
double LogWeight(const TrackFit& fit) { return fit.state.log_weight; }
double& LogWeight(TrackState& state) { return state.log_weight; }
double& LogWeight(TrackFit& fit) { return fit.state.log_weight; }

template <typename T>
void Normalize(std::vector<T>* all) {
  double sum = -std::numeric_limits<double>::infinity();
  for (const T& one : *all) sum = LogAdd(sum, LogWeight(one));
  for (T& one : *all) LogWeight(one) -= sum;
}

// Keeps the order of those that stay; the others' memory stays, too.
template <typename T, typename Stays>
void Keep(const Stays& stays, Spares<T>* spares, std::vector<T>* all) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < all->size(); ++i) {
    if (!stays((*all)[i], i)) continue;
    if (kept != i) std::swap((*all)[kept], (*all)[i]);
    ++kept;
  }
  spares->Resize(kept, all);
}

template <typename T>
void RankAny(const TrackerOptions& options, Spares<T>* spares, std::vector<T>* all) {
  Normalize(all);
  const auto is_more = [](const T& a, const T& b) { return LogWeight(a) > LogWeight(b); };
  const auto best = std::min_element(all->begin(), all->end(), is_more);
  if (LogWeight(*best) > LogWeight(all->front()) + std::log(options.flip_odds))
    std::rotate(all->begin(), best, best + 1);
  // Few: by insertion, which keeps the order of equals and needs no memory.
  for (auto one = all->begin() + 1; one < all->end(); ++one)
    std::rotate(std::upper_bound(all->begin() + 1, one, *one, is_more), one, one + 1);
  const double least = std::log(options.min_probability);
  const auto most = static_cast<std::size_t>(options.max_hypotheses);
  Keep([&](const T& one, std::size_t i) { return i == 0 || LogWeight(one) >= least; }, spares, all);
  if (all->size() > most) spares->Resize(most, all);
  Normalize(all);
}

}  // namespace

void Merge(const TrackMap& map, MergedWeight weight, Spares<TrackFit>* spares,
           std::vector<TrackFit>* fits) {
  std::size_t merged = 0;  // The first ones are different.
  for (std::size_t i = 0; i < fits->size(); ++i) {
    TrackFit& fit = (*fits)[i];
    std::size_t same = 0;
    while (same < merged && !IsSame(map, fit, (*fits)[same])) ++same;
    if (same == merged) {
      if (merged != i) std::swap((*fits)[merged], fit);
      ++merged;
      continue;
    }
    TrackFit& other = (*fits)[same];
    const double a = other.state.log_weight, b = fit.state.log_weight;
    if (b > a) std::swap(other, fit);
    other.state.log_weight = weight == MergedWeight::kSum ? LogAdd(a, b) : std::max(a, b);
  }
  spares->Resize(merged, fits);
}

void Rank(const TrackerOptions& options, Spares<TrackState>* spares,
          std::vector<TrackState>* states) {
  RankAny(options, spares, states);
}
void Rank(const TrackerOptions& options, Spares<TrackFit>* spares, std::vector<TrackFit>* fits) {
  RankAny(options, spares, fits);
}

}  // namespace circline
