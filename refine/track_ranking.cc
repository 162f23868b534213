#include "circline/refine/track_ranking.h"

#include <Eigen/Cholesky>
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
  Eigen::VectorXd e(size);
  e.head<3>() = LogRotation(p.rotation.transpose() * q.rotation);
  if (size == 6) e.tail<3>() = q.translation - p.translation;
  const Eigen::LLT<Eigen::MatrixXd> llt(a.state.covariance.topLeftCorner(size, size) +
                                        b.state.covariance.topLeftCorner(size, size));
  return llt.info() == Eigen::Success && e.dot(llt.solve(e)) < kSame;
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

template <typename T>
void RankAny(const TrackerOptions& options, std::vector<T>* all) {
  Normalize(all);
  const auto is_more = [](const T& a, const T& b) { return LogWeight(a) > LogWeight(b); };
  const auto best = std::min_element(all->begin(), all->end(), is_more);
  if (LogWeight(*best) > LogWeight(all->front()) + std::log(options.flip_odds))
    std::rotate(all->begin(), best, best + 1);
  std::stable_sort(all->begin() + 1, all->end(), is_more);
  const double least = std::log(options.min_probability);
  all->erase(std::remove_if(all->begin() + 1, all->end(),
                            [&](const T& one) { return LogWeight(one) < least; }),
             all->end());
  const auto most = static_cast<std::size_t>(options.max_hypotheses);
  if (all->size() > most) all->erase(all->begin() + options.max_hypotheses, all->end());
  Normalize(all);
}

}  // namespace

void Merge(const TrackMap& map, MergedWeight weight, std::vector<TrackFit>* fits) {
  std::vector<TrackFit> merged;
  for (TrackFit& fit : *fits) {
    const auto same = std::find_if(merged.begin(), merged.end(),
                                   [&](const TrackFit& other) { return IsSame(map, fit, other); });
    if (same == merged.end()) {
      merged.push_back(std::move(fit));
      continue;
    }
    const double a = same->state.log_weight, b = fit.state.log_weight;
    if (b > a) *same = std::move(fit);
    same->state.log_weight = weight == MergedWeight::kSum ? LogAdd(a, b) : std::max(a, b);
  }
  *fits = std::move(merged);
}

void Rank(const TrackerOptions& options, std::vector<TrackState>* states) {
  RankAny(options, states);
}
void Rank(const TrackerOptions& options, std::vector<TrackFit>* fits) { RankAny(options, fits); }

}  // namespace circline
