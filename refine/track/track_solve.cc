// A hypothesis refined on a frame by ceres: the minimum of the frame's terms and the prior, without
// what contradicts the rest.
#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "circline/estimators/statistics.h"
#include "circline/refine/nearby_solve.h"
#include "circline/refine/track/track_frame.h"

namespace circline {

// The prior of the blocks of the map that the active terms have to do with.
bool TrackFrame::ResetPrior(const TrackState& before, const TrackFit& fit) {
  used_.assign(map_.blocks().size(), 0);
  used_[TrackMap::kRotation] = used_[TrackMap::kTranslation] = 1;
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    if (fit.active[i] == 0) continue;
    for (const int b : terms_[i].blocks) {
      if (b >= 0) used_[static_cast<std::size_t>(b)] = 1;
    }
  }
  return prior_.Reset(map_, before, used_);
}

// The values of the prior's blocks, as parameters_.
void TrackFrame::PriorParameters(TrackFit* fit) {
  parameters_.clear();
  for (const int b : prior_.blocks)
    parameters_.push_back(fit->state.x.data() + map_.block(b).offset);
}

// Sets the fit's cost, too, of terms and prior. Returns the number of evaluations.
int TrackFrame::Solve(int max_evaluations, TrackFit* fit) {
  ceres::Problem problem(OwnsNothing());
  double* x = fit->state.x.data();
  int unknowns = static_cast<int>(prior_.rows.size());
  PriorParameters(fit);
  for (std::size_t k = 0; k < parameters_.size(); ++k) {
    const Block& block = map_.block(prior_.blocks[k]);
    problem.AddParameterBlock(parameters_[k], block.size, block.manifold.get());
  }
  problem.AddResidualBlock(&prior_, nullptr, parameters_);
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    if (fit->active[i] == 0) continue;
    parameters_.clear();
    for (const int b : terms_[i].blocks) {
      double* values = b == kOwn ? fit->own.data() + 2 * i : x + map_.block(b).offset;
      parameters_.push_back(values);
      if (b == kOwn) {
        problem.AddParameterBlock(values, terms_[i].own);
        unknowns += terms_[i].own;
      } else if (std::find(prior_.blocks.begin(), prior_.blocks.end(), b) == prior_.blocks.end()) {
        problem.AddParameterBlock(values, map_.block(b).size);
        problem.SetParameterBlockConstant(values);
      }
    }
    problem.AddResidualBlock(terms_[i].cost.get(), nullptr, parameters_);
  }
  // Ceres evaluates once before the first iteration.
  ceres::Solve(NearbyOptions(unknowns, std::max(1, max_evaluations - 1), 1.0), &problem, &summary_);
  fit->cost =
      summary_.IsSolutionUsable() ? summary_.final_cost : std::numeric_limits<double>::infinity();
  return static_cast<int>(summary_.iterations.size());
}

// By how much twice a term's cost exceeds that of its own free fit; infinite where it has none.
double TrackFrame::Excess(std::size_t index, const TrackFit& fit) const {
  return TwiceCost(index, fit) - terms_[index].free_twice_cost;
}

// Makes the terms inactive that contradict the others most: at a compromise of all, any may seem
// to. True where there were any.
bool TrackFrame::LeaveOutWorst(TrackFit* fit) {
  odd_.clear();
  std::ptrdiff_t num_whole = 0;
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    if (terms_[i].parent < 0) ++num_whole;
    if (fit->active[i] == 0) {
      if (terms_[i].parent < 0) num_whole -= 2;  // Less than half of all may be left out.
      continue;
    }
    const double beyond = Excess(i, *fit) - ChiSquareLimit(terms_[i].dof, GateProbability());
    if (beyond > 0.0) odd_.emplace_back(beyond, i);
  }
  std::sort(odd_.begin(), odd_.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first : a.second < b.second;
  });
  bool any = false;
  for (const auto& [beyond, i] : odd_) {
    constexpr double kComparable = 0.5;  // Of the worst.
    // One of two says nothing of which is wrong: the frame contradicts.
    const bool is_whole = terms_[i].parent < 0;
    if (beyond < kComparable * odd_.front().first || (is_whole && num_whole <= 2)) break;
    fit->active[i] = 0;
    num_whole -= is_whole ? 2 : 0;
    any = true;
    for (std::size_t k = 0; k < terms_.size(); ++k) {
      if (terms_[k].parent == static_cast<int>(i)) fit->active[k] = 0;
    }
  }
  return any;
}

// Of what is left out, the term that contradicts least; -1 where there is none.
int TrackFrame::LeastOdd(TrackFit* fit) const {
  int least = -1;
  double excess = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    const Term& term = terms_[i];
    const bool has_parent =
        term.parent < 0 || fit->active[static_cast<std::size_t>(term.parent)] != 0;
    if (fit->active[i] != 0 || !has_parent || !Place(i, fit)) continue;
    const double its = Excess(i, *fit);
    if (!(its < excess)) continue;
    excess = its;
    least = static_cast<int>(i);
  }
  return least;
}

bool TrackFrame::Minimize(const TrackState& before, TrackFit* fit) {
  constexpr int kFew = 2;  // Evaluations that come to nothing.
  int left = tracker_options_.max_evaluations;
  const auto solve = [&](TrackFit* at) {
    if (!ResetPrior(before, *at)) return false;
    left -= Solve(left, at);
    return at->state.x.allFinite();
  };
  if (!solve(fit)) return false;
  bool has_dropped = false;
  while (left > kFew && LeaveOutWorst(fit)) {
    has_dropped = true;
    if (!solve(fit)) return false;
  }
  // What seemed to contradict may have agreed but for the worst: back, one by one, while it does.
  bool agrees = has_dropped;
  while (agrees && left > kFew) {
    with_ = *fit;
    const int back = LeastOdd(&with_);
    if (back < 0) break;
    const auto i = static_cast<std::size_t>(back);
    with_.active[i] = 1;
    agrees = solve(&with_) && Excess(i, with_) <= ChiSquareLimit(terms_[i].dof, GateProbability());
    if (agrees) {
      std::swap(*fit, with_);
    } else if (!ResetPrior(before, *fit)) {
      return false;
    }
  }
  return Score(fit) && Update(before, fit);
}

// What is left out costs what clutter would: as much as what just agrees.
bool TrackFrame::Score(TrackFit* fit) const {
  double left_out = 0.0, free = 0.0;
  fit->dof = 0;
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    const Term& term = terms_[i];
    if (fit->active[i] != 0) {
      fit->dof += term.dof;
      free += term.free_twice_cost;
    } else {
      left_out += 0.5 * (term.free_twice_cost + ChiSquareLimit(term.dof, GateProbability()));
    }
  }
  fit->misfit = 2.0 * fit->cost - free;
  fit->cost += left_out;
  return std::isfinite(fit->cost);
}

}  // namespace circline
