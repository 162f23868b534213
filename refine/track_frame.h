// One frame's evidence, prepared once for all hypotheses of a tracker, and what it makes of each:
// the posterior, as the next frame's prior, and the evidence. Internal: not installed.
#ifndef CIRCLINE_REFINE_TRACK_FRAME_H_
#define CIRCLINE_REFINE_TRACK_FRAME_H_

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "circline/estimators/observations.h"
#include "circline/estimators/point_noise.h"
#include "circline/refine/cost_functions.h"
#include "circline/refine/estimate_pose.h"
#include "circline/refine/track_prior.h"
#include "circline/refine/track_state.h"

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
  // `fitted`: with fits; it and the options outlive this. Features that the map does not have take
  // no part.
  TrackFrame(const Observations& fitted, const PointNoise& noise, const EstimationOptions& options,
             const TrackMap& map);

  bool empty() const { return terms_.empty(); }
  // Refines a hypothesis that has been moved on, from all starts that may lead to minima of its
  // own: the prediction, and both poses of the best known circle. One fit for each minimum found.
  void Refine(const TrackState& prior, const TrackerOptions& options,
              std::vector<TrackFit>* fits) const;

  // Refines one from where it is, but from this focal length (shift of log f). False where that
  // fails.
  bool RefineHere(const TrackState& prior, double log_focal, const TrackerOptions& options,
                  TrackFit* fit) const;

  // Of states where they are, those that the frame's terms cost least, in their order.
  void KeepCheapest(std::size_t most, std::vector<TrackState>* states) const;

  struct Term {
    std::unique_ptr<FeatureCost> cost;
    std::vector<int> blocks;  // Of the map; kOwn: its own unknowns.
    std::string id, name;
    double free_twice_cost = 0.0;
    int dof = 0;      // Of its residuals, less its own unknowns.
    int own = 0;      // Number of unknowns of its own.
    int parent = -1;  // A term without which it says nothing.
  };
  static constexpr int kOwn = -1;
  const std::vector<Term>& terms() const { return terms_; }
  void Parameters(const Term& term, const double* x, const double* own, const double** out) const;

 private:
  class Information;

  void AddCircle(std::size_t index, const TrackMap::Circle& circle, const PointNoise& noise);
  void AddAxis(const std::optional<Segment>& axis, const TrackMap::Direction& direction);
  void AddLine(const LineObservation& line, double sigma_px, int direction, double deviation,
               const std::string& id);
  std::vector<CameraPose> CircleStarts(const TrackState& prior) const;
  bool Begin(const TrackState& prior, const CameraPose& start, TrackFit* fit) const;
  double TermsCost(const TrackFit& fit) const;
  int Solve(const TrackPrior& prior, int max_evaluations, TrackFit* fit) const;
  double Excess(const Term& term, const TrackFit& fit) const;
  bool Place(std::size_t term, TrackFit* fit) const;
  int LeastOdd(TrackFit* fit) const;
  bool LeaveOutWorst(double gate_probability, TrackFit* fit) const;
  bool Score(const TrackPrior& prior, double gate_probability, TrackFit* fit) const;
  void MoveOthers(const std::vector<Eigen::Index>& rows, const Eigen::VectorXd& step,
                  TrackState* state) const;
  std::vector<std::uint8_t> Used(const TrackFit& fit) const;
  bool Update(const TrackState& before, const TrackPrior& prior, TrackFit* fit) const;
  bool RefineFrom(const TrackState& prior, const TrackerOptions& options, TrackFit* fit) const;

  const Observations& observations_;
  const EstimationOptions& options_;
  const TrackMap& map_;
  std::vector<Term> terms_;
  int best_circle_ = -1, best_observation_ = -1;  // In the map, in the observations.
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_TRACK_FRAME_H_
