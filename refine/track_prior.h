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

// z = A (x - mean) is standard normal. A = L^-1 M, L L^T the covariance of the unknowns, M their
// charts at the mean. A camera that is only considered stays at its mean: L L^T is then the
// covariance of the others given that.
struct TrackPrior {
  // `used`: by block of the map. Not ok where the covariance is not positive definite.
  TrackPrior(const TrackMap& map, const TrackState& state, const std::vector<std::uint8_t>& used);
  bool ok() const { return llt.info() == Eigen::Success; }

  // Of the unknowns, one after the other, as in x.
  Eigen::VectorXd Ambient(const TrackMap& map, const Eigen::VectorXd& x) const;
  // How far the unknowns are from the mean, in their charts.
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
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_TRACK_PRIOR_H_
