// What a hypothesis says of the unknowns that a frame has to do with, as a residual. Internal: not
// installed.
#ifndef CIRCLINE_REFINE_TRACK_PRIOR_H_
#define CIRCLINE_REFINE_TRACK_PRIOR_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "circline/refine/scratch.h"
#include "circline/refine/track_state.h"

namespace circline {

// z = A (phi(x) - phi(mean)) is standard normal. A = L^-1 M, L L^T the covariance of the unknowns,
// M takes phi to their tangents at the mean. phi is the identity but for the translation: that is
// known by where the origin is seen and how large things look, for every focal length, so that
// phi(t) = (f tx / tz, f ty / tz, log(tz / f)), f the focal length's share; a Gaussian of t itself
// would claim to know what its curved ridge only happens to cross. A camera that is only considered
// stays at its mean: L L^T is then the covariance of the others given that.
class TrackPrior {
 public:
  TrackPrior();
  ~TrackPrior();

  // Makes it that of a state, in the memory of the one before. `used`: by block of the map. False
  // where the covariance is not positive definite.
  bool Reset(const TrackMap& map, const TrackState& state, const std::vector<std::uint8_t>& used);

  // |z|^2; not finite where phi is not.
  double TwiceCost(const TrackMap& map, const Eigen::VectorXd& x) const;
  // How far the unknowns are from the mean, as tangents there; and its derivatives by them.
  void Moved(const TrackMap& map, const Eigen::VectorXd& x, Scratch::Vector* moved) const;
  void ChartsAt(const TrackMap& map, const Eigen::VectorXd& x, Scratch::Matrix* out) const;

  // Residuals of `blocks`. Keeps its memory: for one thread.
  ceres::CostFunction* cost() const;

  std::vector<int> blocks;                     // Of the unknowns, in the map; constants left out.
  std::vector<Eigen::Index> rows, considered;  // In the state's covariance: theirs, the camera's.
  Scratch::Matrix charts{nullptr, 0, 0};       // M.
  Scratch::Matrix root{nullptr, 0, 0};         // L.
  Scratch::Matrix follow{nullptr, 0, 0};       // By how much the mean follows what is considered.
  Scratch::Matrix considered_covariance{nullptr, 0, 0};

 private:
  class ChartedCost;

  // phi(x) - phi(mean) of the unknowns, one after the other.
  void Difference(const TrackMap& map, const Eigen::VectorXd& x, Scratch::Vector* out) const;

  std::unique_ptr<ChartedCost> cost_;
  mutable Scratch scratch_;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_TRACK_PRIOR_H_
