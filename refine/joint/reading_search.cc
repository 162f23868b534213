#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <utility>

#include "circline/estimators/statistics.h"
#include "circline/refine/joint/joint_result.h"
#include "circline/refine/joint/linearization.h"
#include "circline/refine/joint/readings.h"

namespace circline {
namespace {

constexpr std::size_t kMaxReadings = 16;
constexpr std::size_t kMostSamples = 8;  // Beside these, of what agrees with one line.
constexpr double kHopeless = 300.0;      // Gaps that no start comes down.
constexpr double kNoRival = std::numeric_limits<double>::infinity();

constexpr std::size_t kFew = 6;  // Of so few features any may be the odd one.

class ReadingSearch {
 public:
  ReadingSearch(const JointProblem& problem, const std::vector<Seed>& seeds)
      : problem_(problem), seeds_(seeds) {}

  // All minima of all readings that compete. Not ok: no seed could be refined.
  Status Run() {
    // Lines that a fit has found odd are left out first, and then all are taken in: the fit knew
    // one pencil only.
    std::vector<Candidate> queue = {{problem_.FirstReading(), seeds_}};
    const Reading everything(problem_.features().size(), 1);
    if (queue.front().reading != everything) queue.push_back({everything, seeds_});
    // What lines agree on is not where the fits of their pencils lead.
    for (AgreeingLines& lines : FindAgreeingPencils(problem_, seeds_))
      queue.push_back({std::move(lines.reading), std::move(lines.seeds)});
    for (Reading& reading : WithoutAngles()) queue.push_back({std::move(reading), seeds_});
    bool has_sampled = false;
    std::size_t most = kMaxReadings + queue.size() - 1;
    for (std::size_t next = 0; next < queue.size() && next < most; ++next) {
      const Candidate candidate = queue[next];
      std::vector<State> minima = RefineAll(candidate);
      std::stable_sort(minima.begin(), minima.end(), HasLessCost);
      // A minimum that costs too much may do so because of what contradicts it.
      constexpr std::size_t kMostMinima = 4;
      minima.resize(std::min(minima.size(), kMostMinima));
      // A compromise of few features may be far from the pose of those that agree; of many it is
      // near.
      const std::size_t num_before = queue.size();
      const std::vector<Seed> near = everything.size() > kFew ? SeedsAt(minima) : candidate.seeds;
      for (const State& minimum : minima) {
        for (Reading& other : Rivals(minimum)) {
          const bool is_known = std::any_of(queue.begin(), queue.end(), [&](const Candidate& c) {
            return problem_.IsSameReading(c.reading, other);
          });
          if (!is_known) queue.push_back({std::move(other), near});
        }
      }
      // A compromise, or a loss that has settled on some odd lines, may not lead to what agrees.
      if (has_sampled || queue.size() == num_before) continue;
      has_sampled = true;
      for (AgreeingLines& lines : FindAgreeingLines(problem_, seeds_, kMostSamples)) {
        queue.push_back({std::move(lines.reading), std::move(lines.seeds)});
        ++most;
      }
    }
    return minima_.empty() ? last_ : Status::Ok();
  }

  // With what is left out counted in their cost, in the order of the seeds.
  std::vector<State>& minima() { return minima_; }

 private:
  struct Candidate {
    Reading reading;
    std::vector<Seed> seeds;
  };

  // Readings without one of the known angles: seeds make little use of these, and lie where a wrong
  // one does not mislead.
  std::vector<Reading> WithoutAngles() const {
    std::vector<Reading> readings;
    for (std::size_t i = 0; i < problem_.features().size(); ++i) {
      if (problem_.features()[i].kind != Feature::Kind::kAngle) continue;
      if (readings.size() == kMostSamples) break;
      readings.emplace_back(problem_.features().size(), 1)[i] = 0;
    }
    return readings;
  }

  std::vector<Seed> SeedsAt(const std::vector<State>& minima) const {
    std::vector<Seed> seeds;
    for (const State& minimum : minima)
      seeds.push_back({problem_.PoseAt(minimum), problem_.LogFocalAt(minimum),
                       static_cast<int>(seeds.size()) + 1});
    return seeds;
  }

  // The minima that the seeds lead to, in the order of the seeds.
  std::vector<State> RefineAll(const Candidate& candidate) {
    const std::vector<Seed>& seeds = candidate.seeds;
    std::vector<std::pair<std::size_t, State>> found;
    std::vector<std::size_t> tried;
    const int best_circle = BestCircle(candidate);
    double best = kNoRival;
    bool is_consistent = false;  // The best one explains all that is to take part.
    for (SeedStart& start : StartsOf(problem_, seeds, candidate.reading, &last_)) {
      State& state = start.state;
      // Where all evidence agrees, one circle's planes are those of all.
      const int source = seeds[start.seed].source;
      if (is_consistent && source < 0 && source != best_circle) continue;
      const bool is_near = std::any_of(tried.begin(), tried.end(), [&](std::size_t other) {
        return IsSameSeed(seeds[start.seed], seeds[other]) && seeds[other].source != source;
      });
      if (is_consistent && (is_near || start.cost > best + kHopeless * MaxGap())) continue;
      tried.push_back(start.seed);
      if (!SolveFrom(is_consistent, best, &state)) continue;
      const bool is_known = std::any_of(found.begin(), found.end(), [&](const auto& other) {
        return IsSamePose(problem_, state, other.second);
      });
      if (is_known) continue;
      if (state.cost < best) {
        best = state.cost;
        is_consistent =
            problem_.IsSameReading(state.active, candidate.reading) && IsConsistent(state);
      }
      found.emplace_back(FirstLike(seeds, start.seed), std::move(state));
    }
    std::stable_sort(found.begin(), found.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<State> minima;
    for (auto& [seed, state] : found) {
      minima.push_back(state);
      Keep(std::move(state));
    }
    return minima;
  }

  // A minimum for the answer, with all that agrees with it.
  void Keep(State state) {
    // What has no inliers has no say: the minimum without it is that of another reading.
    State inliers = state;
    if (DropOutliers(problem_, &inliers)) return;
    TakeBackWhatFits(problem_, &state);
    const auto known = std::find_if(minima_.begin(), minima_.end(), [&](const State& other) {
      return IsSamePose(problem_, state, other);
    });
    if (known == minima_.end()) {
      minima_.push_back(std::move(state));
    } else if (state.cost < known->cost) {
      *known = std::move(state);
    }
  }

  // The first seed that is as near to the same minimum.
  static std::size_t FirstLike(const std::vector<Seed>& seeds, std::size_t seed) {
    std::size_t first = 0;
    while (!IsSameSeed(seeds[first], seeds[seed])) ++first;
    return first;
  }

  // Source of the seeds of the best known circle that takes part; 0 where none does.
  int BestCircle(const Candidate& candidate) const {
    for (const Seed& seed : candidate.seeds) {
      for (const JointProblem::CircleBlocks& c : problem_.circles()) {
        if (seed.circle == c.observation &&
            candidate.reading[static_cast<std::size_t>(c.feature)] != 0)
          return seed.source;
      }
    }
    return 0;
  }

  // Refines a start, its cost then with what is left out. False where that fails or leads to
  // nothing that can compete: where another minimum explains all evidence, a rival lies near its
  // own start; where none does yet, one is looked for from far off.
  bool SolveFrom(bool is_consistent, double best, State* state) {
    const int max_iterations = problem_.options().max_iterations;
    const double left_out = LeftOutCost(problem_, *state);
    last_ = is_consistent ? problem_.Solve(max_iterations, state, best - left_out + MaxGap())
                          : problem_.SolveGraduated(max_iterations, state);
    if (!last_.ok()) return false;
    state->cost += left_out;
    return true;
  }

  // Twice what all features together miss their own free fits by: none contradicts the others by
  // more.
  double TotalMisfit(const State& state) const {
    return 2.0 * (problem_.Cost(state) - problem_.FreeCost(state));
  }

  // Of all features together.
  int DegreesOfFreedom(const State& state) const {
    int dof = 0;
    for (std::size_t i = 0; i < state.active.size(); ++i)
      dof += problem_.TakesPart(i, state.active) ? problem_.features()[i].dof : 0;
    return std::max(1, dof);
  }

  bool IsConsistent(const State& state) const {
    return TotalMisfit(state) <= ChiSquareLimit(DegreesOfFreedom(state), FalseAlarms(state));
  }

  // Of each feature, that all of a photo raise one in 10 000.
  double FalseAlarms(const State& state) const {
    int count = 0;
    for (std::size_t i = 0; i < state.active.size(); ++i)
      count += problem_.TakesPart(i, state.active) ? 1 : 0;
    return 1e-4 / std::max(1, count);
  }

  // Readings without what contradicts this minimum.
  std::vector<Reading> Rivals(const State& minimum) const {
    std::vector<Reading> rivals;
    State without = minimum;
    if (DropOutliers(problem_, &without)) rivals.push_back(without.active);
    if (TotalMisfit(minimum) > ChiSquareLimit(1, FalseAlarms(minimum))) {
      Linearization at(problem_, minimum, Weighing());
      if (at.ok() && at.ComputeCovariance())
        AddWithout(minimum, at.Misfits(), FalseAlarms(minimum), &rivals);
    }
    return rivals;
  }

  void AddWithout(const State& minimum, const std::vector<Linearization::Misfit>& misfits, double p,
                  std::vector<Reading>* rivals) const {
    std::vector<std::pair<double, std::size_t>> excess;
    for (std::size_t i = 0; i < misfits.size(); ++i) {
      const double limit = ChiSquareLimit(misfits[i].dof, p);
      if (misfits[i].d2 > limit) excess.emplace_back(misfits[i].d2 - limit, i);
    }
    std::sort(excess.begin(), excess.end(), [](const auto& a, const auto& b) {
      return a.first != b.first ? a.first > b.first : a.second < b.second;
    });
    // Of few features it may be any, whatever the misfits at a compromise of all; of many the
    // worst, and where many are as bad all of them at once: what agrees then comes back.
    constexpr std::size_t kMost = 3;
    constexpr double kComparable = 0.3;  // Of the worst.
    if (misfits.size() > kFew) {
      const auto better = std::find_if(excess.begin(), excess.end(), [&](const auto& e) {
        return e.first < kComparable * excess.front().first;
      });
      excess.erase(better, excess.end());
      if (excess.size() > kMost) {
        rivals->push_back(minimum.active);
        for (const auto& [unused, feature] : excess) rivals->back()[feature] = 0;
        return;
      }
    }
    for (const auto& [unused, feature] : excess) {
      rivals->push_back(minimum.active);
      rivals->back()[feature] = 0;
    }
  }

  double MaxGap() const { return problem_.options().max_cost_gap; }

  const JointProblem& problem_;
  const std::vector<Seed>& seeds_;
  std::vector<State> minima_;
  Status last_ = Status::Failed("no seed pose could be refined");
};

}  // namespace

bool IsSamePose(const JointProblem& problem, const State& a, const State& b, double tolerance) {
  if (!problem.IsSameReading(a.active, b.active)) return false;
  if (problem.IsOnePencil(a)) return true;
  const CameraPose p = problem.PoseAt(a), q = problem.PoseAt(b);
  const Eigen::Matrix3d &A = p.rotation, &B = q.rotation;
  const Eigen::Vector3d &s = p.translation, &t = q.translation;
  if (problem.OriginIsPlaced(a) && s.cross(t).norm() > tolerance * s.norm() * t.norm())
    return false;
  if (A.col(2).cross(B.col(2)).norm() > tolerance) return false;
  return problem.SpinIsFree(a) || A.col(0).cross(B.col(0)).norm() < tolerance;
}

std::vector<SeedStart> StartsOf(const JointProblem& problem, const std::vector<Seed>& seeds,
                                const Reading& reading, Status* last) {
  std::vector<SeedStart> starts;
  for (std::size_t i = 0; i < seeds.size(); ++i) {
    State state;
    *last = problem.Start(seeds[i].pose, seeds[i].log_focal, reading, &state);
    if (!last->ok()) continue;
    const double cost = state.cost + LeftOutCost(problem, state);
    starts.push_back({std::move(state), cost, i});
  }
  std::stable_sort(starts.begin(), starts.end(),
                   [](const SeedStart& a, const SeedStart& b) { return a.cost < b.cost; });
  return starts;
}

Status FindMinima(const JointProblem& problem, const std::vector<Seed>& seeds,
                  std::vector<State>* minima) {
  ReadingSearch search(problem, seeds);
  const Status status = search.Run();
  *minima = std::move(search.minima());
  return status;
}

}  // namespace circline
