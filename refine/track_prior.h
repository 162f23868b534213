// What a hypothesis says of the unknowns that a frame has to do with, as a residual. Internal: not
// installed.
#ifndef CIRCLINE_REFINE_TRACK_PRIOR_H_
#define CIRCLINE_REFINE_TRACK_PRIOR_H_

#include <ceres/cost_function.h>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <memory>
#include <vector>

#include "circline/refine/track_state.h"

namespace circline {

// z = A (phi(x) - phi(mean)) is standard normal. A = L^-1 M, L L^T the covariance of the unknowns,
// M takes phi to their tangents at the mean. phi is the identity but for the translation: that is
// known by where the origin is seen and how large things look, for every focal length, so that
// phi(t) = (f tx / tz, f ty / tz, log(tz / f)), f the focal length's share; a Gaussian of t itself
// would claim to know what its curved ridge only happens to cross. A camera that is only considered
// stays at its mean: L L^T is then the covariance of the others given that.
struct TrackPrior {
  // `used`: by block of the map. Not ok where the covariance is not positive definite.
  TrackPrior(const TrackMap& map, const TrackState& state, const std::vector<std::uint8_t>& used);
  bool ok() const { return llt.info() == Eigen::Success; }

  // phi of the unknowns, one after the other.
  Eigen::VectorXd Ambient(const TrackMap& map, const Eigen::VectorXd& x) const;
  // Derivatives of Moved() by the unknowns, at x.
  Eigen::MatrixXd ChartsAt(const TrackMap& map, const Eigen::VectorXd& x) const;
  // How far the unknowns are from the mean, as tangents there.
  Eigen::VectorXd Moved(const TrackMap& map, const Eigen::VectorXd& x) const {
    return charts * (Ambient(map, x) - mean);
  }

  std::vector<int> blocks;                     // Of the unknowns, in the map; constants left out.
  std::vector<Eigen::Index> rows, considered;  // In the state's covariance: theirs, the camera's.
  Eigen::MatrixXd charts, A;
  Eigen::VectorXd mean;
  Eigen::LLT<Eigen::MatrixXd> llt;
  Eigen::MatrixXd follow;  // By how much the mean follows what is considered.
  Eigen::MatrixXd considered_covariance;
  std::unique_ptr<ceres::CostFunction> cost;  // By `blocks`.

 private:
  Eigen::VectorXd Raw(const TrackMap& map, const Eigen::VectorXd& x) const;
  // First rows of the translation and of the camera in phi; -1: not charted, not an unknown.
  Eigen::Index translation_ = -1, camera_ = -1;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_TRACK_PRIOR_H_
