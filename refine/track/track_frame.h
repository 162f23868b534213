// One frame's evidence, prepared once for all hypotheses of a tracker, and what it makes of each:
// the posterior, as the next frame's prior, and the evidence. Keeps its memory from frame to frame.
// Internal: not installed.
#ifndef CIRCLINE_REFINE_TRACK_TRACK_FRAME_H_
#define CIRCLINE_REFINE_TRACK_TRACK_FRAME_H_

#include <ceres/solver.h>

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "circline/estimators/observations.h"
#include "circline/refine/cost_functions.h"
#include "circline/refine/estimate_pose.h"
#include "circline/refine/track/scratch.h"
#include "circline/refine/track/track_prior.h"
#include "circline/refine/track/track_state.h"

namespace circline {

// A hypothesis after a frame. Its log_weight has been multiplied by the frame's evidence.
struct TrackFit {
  TrackState state;
  std::vector<std::uint8_t> active;  // By term: takes part.
  std::vector<double> own;           // The terms' own unknowns, two each.
  double cost = 0.0;                 // Of the frame, with the prior and what is left out.
  // Twice the cost less that of the features' own free fits: chi-square with so many degrees of
  // freedom where the frame agrees with the prior.
  double misfit = 0.0;
  int dof = 0;
};

class TrackFrame {
 public:
  // Of no features yet; options and map outlive this.
  TrackFrame(const TrackerOptions& options, const TrackMap& map)
      : tracker_options_(options), options_(options.estimation), map_(map) {}

  // Takes a frame's features in place of those before. `fitted`: with fits and noise; it is used
  // until the next call. Features that the map does not have take no part. `news`: the power of its
  // evidence (FrameNews).
  void Reset(const Observations& fitted, double news = 1.0);

  bool empty() const { return terms_.empty(); }
  // Refines a hypothesis that has been moved on, from all starts that may lead to minima of its
  // own: the prediction, and both poses of the best known circle. Adds one fit for each minimum
  // found.
  void Refine(const TrackState& prior, Kept<TrackFit>* fits);

  // Refines one from this pose and focal length (shift of log f). False, and no fit added, where
  // that fails.
  bool RefineFrom(const TrackState& prior, const CameraPose& pose, double log_focal,
                  Kept<TrackFit>* fits);

  struct Term {
    enum class Kind { kCircle, kCenter, kLine };
    Kind kind = Kind::kLine;
    std::vector<int> blocks;  // Of the map; kOwn: its own unknowns.
    std::string id;
    double free_twice_cost = 0.0;
    int dof = 0;      // Of its residuals, less its own unknowns.
    int own = 0;      // Number of unknowns of its own.
    int parent = -1;  // A term without which it says nothing.
    int layout = 0;   // Which optional blocks its cost function has.
    std::unique_ptr<FeatureCost> cost;

    std::string Name() const;  // For people.
  };
  static constexpr int kOwn = -1;
  const Kept<Term>& terms() const { return terms_; }
  void Parameters(const Term& term, const double* x, const double* own, const double** out) const;

 private:
  class Information;

  Term& AddTerm(Term::Kind kind, int layout);
  void AddCircle(std::size_t index, const TrackMap::Circle& circle);
  void AddCenter(const CircleObservation& seen, const TrackMap::Circle& circle, double sigma_px);
  void AddAxis(const std::optional<Segment>& axis, const TrackMap::Direction& direction);
  void AddPencil(const PencilObservation& pencil, const TrackMap::Direction& direction);
  // `number`: of its pencil's lines; -1: an axis.
  void AddLine(const LineObservation& line, double sigma_px, const TrackMap::Direction& direction,
               double deviation, int number);
  int CircleStarts(const TrackState& prior, CameraPose* starts) const;
  bool Begin(const TrackState& prior, const CameraPose& start, double log_focal,
             TrackFit* fit) const;
  double LogFocal(const TrackState& state) const {
    return state.x[map_.block(TrackMap::kCamera).offset];
  }
  // Of a test of each term.
  double GateProbability() const {
    return tracker_options_.gate_probability / static_cast<double>(terms_.size());
  }
  double TermsCost(const TrackFit& fit) const;
  int Solve(int max_evaluations, TrackFit* fit);
  double TwiceCost(std::size_t term, const TrackFit& fit) const;
  double Excess(std::size_t term, const TrackFit& fit) const;
  bool Place(std::size_t term, TrackFit* fit) const;
  int LeastOdd(TrackFit* fit) const;
  bool LeaveOutWorst(TrackFit* fit);
  bool Score(TrackFit* fit) const;
  bool UpdateOthers(const TrackState& before, const Scratch::Matrix& posterior,
                    const Scratch::Matrix& turn, const Scratch::Vector& moved_by, TrackFit* fit);
  void PriorParameters(TrackFit* fit);
  bool ResetPrior(const TrackState& before, const TrackFit& fit);
  bool Update(const TrackState& before, TrackFit* fit);
  void HoldCamera(const TrackState& before, TrackState* state);
  bool Minimize(const TrackState& prior, TrackFit* fit);

  const TrackerOptions& tracker_options_;
  const EstimationOptions& options_;  // Of the same.
  const TrackMap& map_;
  const Observations* observations_ = nullptr;
  double news_ = 1.0;
  Kept<Term> terms_;
  int best_circle_ = -1, best_observation_ = -1;  // In the map, in the observations.

  // Memory.
  ceres::Solver::Summary summary_;  // Made of a sentence.
  TrackPrior prior_;                // Of the last solve.
  Scratch scratch_;
  ImagePoints points_;
  TrackFit begun_, with_;
  std::vector<std::uint8_t> used_;                   // By block.
  std::vector<double*> parameters_;                  // Of a residual.
  std::vector<std::pair<double, std::size_t>> odd_;  // Terms by how much they contradict.
  std::vector<Eigen::Index> rows_, others_;          // Of the covariance: that a frame has, or not.
  std::vector<Eigen::Index> columns_;                // Of the information, by block; -1: none.
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_TRACK_TRACK_FRAME_H_
