// Many photos: how well cameras and poses are known.
#include <Eigen/Dense>
#include <vector>

#include "circline/refine/adjust_problem.h"
#include "circline/refine/block_chain.h"
#include "circline/refine/linearization.h"

namespace circline {

AdjustProblem::Covariances AdjustProblem::OfPriors() const {
  Covariances out;
  for (const std::array<double, kCameraSize>& prior : camera_sigmas_) {
    const Eigen::Map<const Eigen::Array<double, kCameraSize, 1>> sigma(prior.data());
    out.cameras.emplace_back(sigma.square().matrix().asDiagonal());
  }
  out.poses.assign(photos_.size(), Matrix6d::Zero());
  return out;
}

Matrix6d AdjustProblem::PoseCovariance(std::size_t photo, const Linearization& at) const {
  // d [delta, delta_t] / d (the tangents of both blocks).
  Eigen::Matrix<double, 6, Eigen::Dynamic> slopes = Eigen::Matrix<double, 6, 6>::Zero();
  std::vector<int> columns = at.Columns(rotations_[photo]);
  const auto turns = static_cast<Eigen::Index>(columns.size());
  // The block turns the world: exp([R d]x) R = R exp([d]x).
  slopes.topLeftCorner(3, turns) = RotationFromBlock(Values(rotations_[photo])).leftCols(turns);
  const std::vector<int> shifts = at.Columns(translations_[photo]);
  if (!shifts.empty()) {
    const BlockMatrix plus = block(translations_[photo]).PlusJacobian(Values(translations_[photo]));
    slopes.block(3, turns, 3, plus.cols()) = plus;
    columns.insert(columns.end(), shifts.begin(), shifts.end());
  }
  const auto by = slopes.leftCols(static_cast<Eigen::Index>(columns.size()));
  return by * at.Covariance(columns) * by.transpose();
}

AdjustProblem::Covariances AdjustProblem::Covariance(int end, bool at_minimum) const {
  Weighing inliers;
  inliers.inliers_only = true;
  constexpr double kTiny = 1e-10;  // What nothing ties (one circle's spin) says nothing.
  Linearization::Options options;
  options.floor = kTiny;
  options.at_minimum = at_minimum;
  Linearization at(*this, ActiveTerms(end), values().data(), inliers, options);
  Covariances out = OfPriors();
  if (!at.ComputeCovariance()) return out;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const std::vector<int> columns = at.Columns(cameras_[c]);
    if (columns.empty()) continue;
    const BlockMatrix plus = block(cameras_[c]).PlusJacobian(Values(cameras_[c]));
    out.cameras[c] = plus * at.Covariance(columns) * plus.transpose();
  }
  if (!given_.empty()) out.log_scale = at.Covariance(at.Columns(given_[2])).trace();
  for (std::size_t i = 0; i < photos_.size(); ++i) {
    if (rotations_[i] >= 0 && static_cast<int>(i) < end) out.poses[i] = PoseCovariance(i, at);
  }
  return out;
}

}  // namespace circline
