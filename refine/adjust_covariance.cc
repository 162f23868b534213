// Many photos: how well cameras and poses are known.
#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <algorithm>
#include <numeric>

#include "circline/refine/adjust_problem.h"
#include "circline/refine/block_chain.h"
#include "circline/refine/inverse_on_pattern.h"
#include "circline/refine/joint_problem.h"
#include "circline/refine/nearby_solve.h"

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

Matrix6d AdjustProblem::PoseCovariance(int photo, const InverseOnPattern& inverse,
                                       const std::map<const double*, int>& offsets) const {
  const auto i = static_cast<std::size_t>(photo);
  // d [delta, delta_t] / d (the tangents of both blocks).
  Eigen::Matrix<double, 6, Eigen::Dynamic> slopes = Eigen::Matrix<double, 6, 6>::Zero();
  std::vector<int> columns;
  const auto rotation = offsets.find(rotations_[i]), translation = offsets.find(translations_[i]);
  if (rotation != offsets.end()) {
    const int size = blocks_.at(rotations_[i]).manifold->TangentSize();
    // The block turns the world: exp([R d]x) R = R exp([d]x).
    slopes.topLeftCorner(3, size) = RotationFromBlock(rotations_[i]).leftCols(size);
    for (int k = 0; k < size; ++k) columns.push_back(rotation->second + k);
  }
  if (translation != offsets.end()) {
    const ceres::Manifold* manifold = blocks_.at(translations_[i]).manifold;
    const int size = manifold != nullptr ? manifold->TangentSize() : 3;
    slopes.block(3, static_cast<int>(columns.size()), 3, size) =
        circline::Block{0, 3, manifold}.PlusJacobian(translations_[i]);
    for (int k = 0; k < size; ++k) columns.push_back(translation->second + k);
  }
  const auto by = slopes.leftCols(static_cast<Eigen::Index>(columns.size()));
  return by * inverse(columns) * by.transpose();
}

AdjustProblem::Covariances AdjustProblem::Covariance(int end) const {
  Weighing inliers;
  inliers.inliers_only = true;
  for (const Feature& feature : features_) feature.cost->set_weighing(inliers);
  ceres::Problem problem(OwnsNothing());
  Fill(all_free_, end, &problem);
  ceres::CRSMatrix crs;
  ceres::Problem::EvaluateOptions evaluate;
  evaluate.apply_loss_function = false;  // A prior that is mostly exact counts as its Gaussian.
  std::map<const double*, int> offsets;
  int size = 0;
  for (const auto& block : values_) {  // As they were made, not by address: the same bits out.
    double* const at = const_cast<double*>(block.data());
    if (!problem.HasParameterBlock(at) || problem.IsParameterBlockConstant(at)) continue;
    evaluate.parameter_blocks.push_back(at);
    offsets[at] = size;
    size += problem.ParameterBlockTangentSize(at);
  }
  const bool evaluated = size > 0 && problem.Evaluate(evaluate, nullptr, nullptr, nullptr, &crs);
  for (const Feature& feature : features_) feature.cost->set_weighing(Weighing());
  Covariances out = OfPriors();
  if (!evaluated) return out;
  const Eigen::Map<const Eigen::SparseMatrix<double, Eigen::RowMajor>> J(
      crs.num_rows, crs.num_cols, static_cast<int>(crs.values.size()), crs.rows.data(),
      crs.cols.data(), crs.values.data());
  using Sparse = InverseOnPattern::Sparse;
  Sparse information = Sparse(J.transpose()) * Sparse(J);
  constexpr double kTiny = 1e-10;  // What nothing ties (one circle's spin) says nothing.
  for (int k = 0; k < size; ++k)
    information.coeffRef(k, k) = information.coeff(k, k) * (1.0 + kTiny) + kTiny;
  const InverseOnPattern inverse(information);
  if (!inverse.ok()) return out;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const auto own = offsets.find(cameras_[c]);
    if (own == offsets.end()) continue;
    std::vector<int> columns(
        static_cast<std::size_t>(problem.ParameterBlockTangentSize(cameras_[c])));
    std::iota(columns.begin(), columns.end(), own->second);
    const BlockMatrix plus = PlusJacobianOf(*all_free_[c], cameras_[c]);
    out.cameras[c] = plus * inverse(columns) * plus.transpose();
  }
  if (!given_.empty()) {
    const int at = offsets.at(given_[2]);
    out.log_scale = inverse(at, at);
  }
  for (std::size_t i = 0; i < photos_.size(); ++i) {
    if (rotations_[i] != nullptr && static_cast<int>(i) < end)
      out.poses[i] = PoseCovariance(static_cast<int>(i), inverse, offsets);
  }
  return out;
}

}  // namespace circline
