#include "circline/refine/track/track_prior.h"

#include <Eigen/Dense>

#include "circline/refine/block_chain.h"

namespace circline {

bool TrackPrior::Evaluate(const double* const* parameters, double* residuals,
                          double** jacobians) const {
  const Eigen::Index rows = by_values.rows();
  Eigen::Index first = 0;
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    const int size = parameter_block_sizes()[k];
    off_.segment(first, size) =
        Eigen::Map<const Eigen::VectorXd>(parameters[k], size) - mean_.segment(first, size);
    if (jacobians != nullptr && jacobians[k] != nullptr)
      Eigen::Map<RowMajor>(jacobians[k], rows, size) = by_values.middleCols(first, size);
    first += size;
  }
  Eigen::Map<Eigen::VectorXd>(residuals, rows).noalias() = by_values * off_;
  return true;
}

bool TrackPrior::Reset(const TrackMap& map, const TrackState& state,
                       const std::vector<std::uint8_t>& used) {
  blocks.clear();
  rows.clear();
  considered.clear();
  mutable_parameter_block_sizes()->clear();
  Eigen::Index ambient = 0;
  for (int b = 0; b < map.size(); ++b) {
    const Block& block = map.block(b);
    if (used[static_cast<std::size_t>(b)] == 0 || block.tangent_size() == 0) continue;
    const bool is_considered = b == TrackMap::kCamera && map.camera_is_considered;
    for (int k = 0; k < block.tangent_size(); ++k)
      (is_considered ? considered : rows).push_back(map.tangent(b) + k);
    if (is_considered) continue;
    blocks.push_back(b);
    mutable_parameter_block_sizes()->push_back(block.size);
    ambient += block.size;
  }
  const auto n = static_cast<Eigen::Index>(rows.size()),
             c = static_cast<Eigen::Index>(considered.size());
  set_num_residuals(static_cast<int>(n));
  scratch_.Clear();
  Rebind(scratch_.NewMatrix(n, n), &root);
  Rebind(scratch_.NewMatrix(n, c), &follow);
  Rebind(scratch_.NewMatrix(c, c), &considered_covariance);
  Rebind(scratch_.NewMatrix(n, ambient), &by_values);
  for (Scratch::Vector* vector : {&mean_, &off_}) Rebind(scratch_.NewVector(ambient), vector);

  by_values.setZero();
  Eigen::Index row = 0, column = 0;
  for (const int b : blocks) {
    const Block& block = map.block(b);
    const double* values = state.x.data() + block.offset;
    by_values.block(row, column, block.tangent_size(), block.size) = block.Chart(values);
    mean_.segment(column, block.size) = Eigen::Map<const Eigen::VectorXd>(values, block.size);
    row += block.tangent_size();
    column += block.size;
  }
  const auto unknown = Indices(rows), counted = Indices(considered);
  root = state.covariance(unknown, unknown);
  considered_covariance = state.covariance(counted, counted);
  if (c > 0) {
    const Scratch::Scope scope(&scratch_);
    Scratch::Matrix across = scratch_.NewMatrix(c, n), gain = scratch_.NewMatrix(c, n),
                    camera = scratch_.NewMatrix(c, c);
    across = state.covariance(counted, unknown);
    camera = considered_covariance;
    if (!FactorInPlace(camera)) return false;
    gain = across;
    SolveInPlace(camera, gain);
    follow = gain.transpose();
    root.noalias() -= follow * across;
  }
  if (!FactorInPlace(root)) return false;
  HalfSolveInPlace(root, by_values);
  return true;
}

}  // namespace circline
