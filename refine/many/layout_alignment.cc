// Pairs of circles, and the similarity that maps them onto each other.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <utility>

#include "circline/estimators/statistics.h"
#include "circline/refine/many/adjust_layout.h"

namespace circline {
namespace {

constexpr double kReach = 0.3;  // Deviation of two sights of one circle.

// How far each circle's nearest other one is; infinity where there is none.
std::vector<double> Gaps(const Places& places) {
  std::vector<double> gaps(places.size(), std::numeric_limits<double>::infinity());
  for (std::size_t k = 0; k < places.size(); ++k) {
    for (std::size_t other = 0; other < k; ++other) {
      const double gap = (places[other].circle.center - places[k].circle.center).norm();
      gaps[k] = std::min(gaps[k], gap);
      gaps[other] = std::min(gaps[other], gap);
    }
  }
  return gaps;
}

// Each circle and those next to it: the nearest one, and what is about as near, as on a lattice.
Pairs NeighbourPairs(const Places& places) {
  constexpr double kAsNear = 1.25;
  const std::vector<double> gaps = Gaps(places);
  Pairs pairs;
  for (std::size_t k = 0; k < places.size(); ++k) {
    for (std::size_t other = 0; other < places.size(); ++other) {
      const double gap = (places[other].circle.center - places[k].circle.center).norm();
      if (other != k && gap < kAsNear * std::max(gaps[k], gaps[other])) pairs.push_back({k, other});
    }
  }
  return pairs;
}

// Which maps of the plane are looked for.
enum class Maps { kSimilar, kAffine };

// Least squares of the centres: a similarity (Umeyama 1991) or any affine map. False for fewer than
// two, for points in line where they leave the map open, and for a map that turns the plane over.
bool Fit(const Places& from, const Places& to, const Pairs& pairs, Maps maps, Similarity* out) {
  constexpr std::size_t kFewest = 2;
  if (pairs.size() < kFewest) return false;
  Eigen::Vector2d a = Eigen::Vector2d::Zero(), b = a;
  const double n = static_cast<double>(pairs.size());
  for (const auto& [own, shared] : pairs) {
    a += from[own].circle.center / n;
    b += to[shared].circle.center / n;
  }
  Eigen::Matrix2d square = Eigen::Matrix2d::Zero(), product = square;
  for (const auto& [own, shared] : pairs) {
    const Eigen::Vector2d u = from[own].circle.center - a, v = to[shared].circle.center - b;
    square += u * u.transpose();
    product += v * u.transpose();
  }
  if (maps == Maps::kSimilar) {
    const double dot = product.trace(), cross = product(1, 0) - product(0, 1);
    product << dot, -cross, cross, dot;
    square = square.trace() * Eigen::Matrix2d::Identity();
  }
  out->turn = product * square.inverse();
  out->scale = std::sqrt(out->turn.determinant());
  out->shift = b - out->turn * a;
  return out->turn.allFinite() && out->scale > 0.0;
}

// In place, units of Place, and in size, the logarithm of its ratio.
double Deviation(const LayoutCircle& from, const Place& to, const Similarity& similarity) {
  return std::hypot((similarity(from.center) - to.circle.center).norm() / to.unit,
                    std::log(similarity.scale * from.radius / to.circle.radius));
}

bool FitAndJudge(const Places& from, const Places& to, Alignment* alignment) {
  if (!Fit(from, to, alignment->pairs, Maps::kSimilar, &alignment->to_shared)) return false;
  std::vector<double> deviations;
  for (const auto& [own, shared] : alignment->pairs)
    deviations.push_back(Deviation(from[own].circle, to[shared], alignment->to_shared));
  alignment->misfit = Median(std::move(deviations));
  return true;
}

// More of them: a pose that is a little off shears and stretches its plane, and two neighbours tell
// little of what is far from them.
Pairs GrownMatches(const Places& from, const Places& to, Pairs pairs) {
  constexpr int kRounds = 6;
  constexpr std::size_t kFewest = 4;
  Similarity affine;
  for (int k = 0; k < kRounds && pairs.size() >= kFewest; ++k) {
    if (!Fit(from, to, pairs, Maps::kAffine, &affine)) break;
    Pairs more = Matches(from, to, affine);
    if (more.size() <= pairs.size()) break;
    pairs = std::move(more);
  }
  return pairs;
}

}  // namespace

Places PlacesOf(const Layout& layout) {
  Places places;
  places.reserve(layout.size());
  for (const auto& [id, circle] : layout) places.push_back({&id, circle, circle.radius});
  std::stable_sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
    return a.circle.center.x() < b.circle.center.x();
  });
  constexpr double kShare = 0.3;  // A board's discs have about that radius, of their distances.
  const std::vector<double> gaps = Gaps(places);
  for (std::size_t k = 0; k < places.size(); ++k) {
    if (std::isfinite(gaps[k])) places[k].unit = std::max(places[k].unit, kShare * gaps[k]);
  }
  for (Place& place : places) {
    const auto alike = std::count_if(places.begin(), places.end(), [&place](const Place& other) {
      return std::abs(std::log(other.circle.radius / place.circle.radius)) < kReach;
    });
    place.weight = 1.0 + std::log(static_cast<double>(places.size()) / static_cast<double>(alike));
  }
  return places;
}

Pairs Matches(const Places& from, const Places& to, const Similarity& similarity) {
  struct Match {
    double deviation;
    std::size_t own, shared;
  };
  double largest = 0.0;
  for (const Place& place : to) largest = std::max(largest, place.unit);
  const double farthest = kReach * largest;
  std::vector<Match> near;
  for (std::size_t own = 0; own < from.size(); ++own) {
    const Eigen::Vector2d at = similarity(from[own].circle.center);
    const auto first =
        std::lower_bound(to.begin(), to.end(), at.x() - farthest,
                         [](const Place& place, double x) { return place.circle.center.x() < x; });
    for (auto k = static_cast<std::size_t>(first - to.begin());
         k < to.size() && to[k].circle.center.x() <= at.x() + farthest; ++k) {
      if (std::abs(to[k].circle.center.y() - at.y()) > farthest) continue;
      const double deviation = Deviation(from[own].circle, to[k], similarity);
      if (deviation < kReach) near.push_back({deviation, own, k});
    }
  }
  std::stable_sort(near.begin(), near.end(),
                   [](const Match& a, const Match& b) { return a.deviation < b.deviation; });
  Pairs pairs;
  std::vector<std::uint8_t> is_matched(from.size(), 0), is_taken(to.size(), 0);
  for (const Match& match : near) {
    if (is_matched[match.own] != 0 || is_taken[match.shared] != 0) continue;
    is_matched[match.own] = is_taken[match.shared] = 1;
    pairs.push_back({match.own, match.shared});
  }
  return pairs;
}

bool AlignById(const Places& from, const Places& to, Alignment* alignment) {
  std::map<std::string, std::size_t> shared;
  for (std::size_t k = 0; k < to.size(); ++k) shared[*to[k].id] = k;
  for (std::size_t k = 0; k < from.size(); ++k) {
    const auto same = shared.find(*from[k].id);
    if (same != shared.end()) alignment->pairs.push_back({k, same->second});
  }
  return FitAndJudge(from, to, alignment);
}

bool AlignFrom(const Places& from, const Places& to, const Similarity& start,
               Alignment* alignment) {
  alignment->pairs = GrownMatches(from, to, Matches(from, to, start));
  return FitAndJudge(from, to, alignment);
}

bool AlignByPattern(const Places& from, const Places& to, Alignment* alignment) {
  constexpr std::size_t kBases = 6;
  constexpr double kSize = 0.2;     // Two circles alike in size and distance, relative.
  constexpr double kHopeful = 0.2;  // Of the best so far: so many matches may grow to as many.
  const Pairs own_pairs = NeighbourPairs(from), shared_pairs = NeighbourPairs(to);
  const std::size_t fewer = std::min(from.size(), to.size());
  const std::size_t step = std::max<std::size_t>(1, own_pairs.size() / kBases);
  double most = 0.0;
  for (std::size_t base = 0; base < own_pairs.size(); base += step) {
    const auto& [a, b] = own_pairs[base];
    for (const auto& [c, d] : shared_pairs) {
      if (alignment->pairs.size() == fewer) break;  // All of them.
      Similarity similarity;
      if (!Fit(from, to, {{a, c}, {b, d}}, Maps::kSimilar, &similarity) ||
          std::abs(std::log(similarity.scale * from[a].circle.radius / to[c].circle.radius)) >
              kSize) {
        continue;
      }
      Pairs pairs = Matches(from, to, similarity);
      if (static_cast<double>(pairs.size()) <
          kHopeful * static_cast<double>(alignment->pairs.size())) {
        continue;
      }
      pairs = GrownMatches(from, to, std::move(pairs));
      double sum = 0.0;
      for (const auto& [own, shared] : pairs) sum += to[shared].weight;
      if (sum <= most) continue;
      most = sum;
      alignment->pairs = std::move(pairs);
    }
  }
  constexpr double kMost = 0.6;  // Of the circles of the photo that has fewer.
  constexpr std::size_t kFewest = 4;
  if (alignment->pairs.size() < kFewest ||
      static_cast<double>(alignment->pairs.size()) < kMost * static_cast<double>(fewer)) {
    return false;
  }
  return FitAndJudge(from, to, alignment);
}

}  // namespace circline
