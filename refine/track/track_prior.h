// What a hypothesis says of the unknowns that a frame has to do with, as a residual. Internal: not
// installed.
#ifndef CIRCLINE_REFINE_TRACK_TRACK_PRIOR_H_
#define CIRCLINE_REFINE_TRACK_TRACK_PRIOR_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "circline/refine/track/scratch.h"
#include "circline/refine/track/track_state.h"

namespace circline {

// z = L^-1 M (x - mean) is standard normal: L L^T is the covariance of the unknowns, M takes
// differences of their values to tangents at the mean. A camera that is only considered stays at
// its mean: L L^T is then the covariance of the others given that.
class TrackPrior final : public ceres::CostFunction {
 public:
  // Makes it that of a state, in the memory of the one before. `used`: by block of the map. False
  // where the covariance is not positive definite.
  bool Reset(const TrackMap& map, const TrackState& state, const std::vector<std::uint8_t>& used);

  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override;

  std::vector<int> blocks;                     // Of the unknowns, in the map; constants left out.
  std::vector<Eigen::Index> rows, considered;  // In the state's covariance: theirs, the camera's.
  Scratch::Matrix root{nullptr, 0, 0};         // L.
  Scratch::Matrix by_values{nullptr, 0, 0};    // L^-1 M, by values of `blocks`.
  Scratch::Matrix follow{nullptr, 0, 0};       // By how much the mean follows what is considered.
  Scratch::Matrix considered_covariance{nullptr, 0, 0};

 private:
  Scratch::Vector mean_{nullptr, 0};
  mutable Scratch::Vector off_{nullptr, 0};
  Scratch scratch_;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_TRACK_TRACK_PRIOR_H_
