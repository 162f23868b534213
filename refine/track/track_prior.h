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

// z = A (phi(x) - phi(mean)) is standard normal. A = L^-1 M, L L^T the covariance of the unknowns,
// M takes phi to their tangents at the mean. phi is the identity but for the translation: that is
// known by where the origin is seen and how large things look, for every focal length, so that
// phi(t) = (f tx / tz, f ty / tz, log(tz / f)), f the focal length's share; a Gaussian of t itself
// would claim to know what its curved ridge only happens to cross. A camera that is only considered
// stays at its mean: L L^T is then the covariance of the others given that.
class TrackPrior final : public ceres::CostFunction {
 public:
  // Makes it that of a state, in the memory of the one before. `used`: by block of the map. False
  // where the covariance is not positive definite.
  bool Reset(const TrackMap& map, const TrackState& state, const std::vector<std::uint8_t>& used);

  // z at these values of `blocks`, and its derivatives by them, one block after the other, unless
  // `J` is null. False where phi is not defined. Keeps its memory: for one thread.
  bool Residuals(const double* const* parameters, double* z, Scratch::Matrix* J) const;
  // The same, as ceres asks for it.
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override;

  Eigen::Index num_values() const { return A_.cols(); }  // Of `blocks`.

  std::vector<int> blocks;                     // Of the unknowns, in the map; constants left out.
  std::vector<Eigen::Index> rows, considered;  // In the state's covariance: theirs, the camera's.
  Scratch::Matrix root{nullptr, 0, 0};         // L.
  Scratch::Matrix follow{nullptr, 0, 0};       // By how much the mean follows what is considered.
  Scratch::Matrix considered_covariance{nullptr, 0, 0};

 private:
  bool Chart(Scratch::Vector* x) const;
  Eigen::Matrix<double, 3, 4> Slope(const Scratch::Vector& x) const;
  void TurnTranslation(const Eigen::Matrix3d& by, Scratch::Matrix* J) const;

  // Where phi has the translation and the focal length; -1: not charted, not an unknown.
  Eigen::Index translation_ = -1, camera_ = -1;
  Scratch::Matrix A_{nullptr, 0, 0};
  Scratch::Vector mean_{nullptr, 0};
  mutable Scratch::Matrix J_{nullptr, 0, 0};
  mutable Scratch::Vector x_{nullptr, 0}, phi_{nullptr, 0};
  Scratch scratch_;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_TRACK_TRACK_PRIOR_H_
