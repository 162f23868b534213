#include "circline/refine/track_prior.h"

#include <utility>

namespace circline {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Residuals A (x - mean) of several blocks.
class LinearCost final : public ceres::CostFunction {
 public:
  LinearCost(Eigen::MatrixXd A, Eigen::VectorXd mean, const std::vector<int>& sizes)
      : A_(std::move(A)), mean_(std::move(mean)) {
    *mutable_parameter_block_sizes() = sizes;
    set_num_residuals(static_cast<int>(A_.rows()));
  }
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    Eigen::Map<Eigen::VectorXd> r(residuals, A_.rows());
    r = -A_ * mean_;
    Eigen::Index first = 0;
    for (std::size_t k = 0; k < parameter_block_sizes().size(); ++k) {
      const int size = parameter_block_sizes()[k];
      r += A_.middleCols(first, size) * Eigen::Map<const Eigen::VectorXd>(parameters[k], size);
      if (jacobians != nullptr && jacobians[k] != nullptr)
        Eigen::Map<RowMajor>(jacobians[k], A_.rows(), size) = A_.middleCols(first, size);
      first += size;
    }
    return true;
  }

 private:
  Eigen::MatrixXd A_;
  Eigen::VectorXd mean_;
};

}  // namespace

Eigen::VectorXd TrackPrior::Ambient(const TrackMap& map, const Eigen::VectorXd& x) const {
  Eigen::VectorXd out(charts.cols());
  Eigen::Index next = 0;
  for (const int b : blocks) {
    out.segment(next, map.block(b).size) = x.segment(map.block(b).offset, map.block(b).size);
    next += map.block(b).size;
  }
  return out;
}

TrackPrior::TrackPrior(const TrackMap& map, const TrackState& state,
                       const std::vector<std::uint8_t>& used) {
  int ambient = 0;
  std::vector<int> sizes;
  for (int b = 0; b < map.size(); ++b) {
    const Block& block = map.block(b);
    if (used[static_cast<std::size_t>(b)] == 0 || block.tangent_size() == 0) continue;
    const bool is_considered = b == TrackMap::kCamera && map.camera_is_considered;
    for (int k = 0; k < block.tangent_size(); ++k)
      (is_considered ? considered : rows).push_back(map.tangent(b) + k);
    if (is_considered) continue;
    blocks.push_back(b);
    sizes.push_back(block.size);
    ambient += block.size;
  }
  charts.setZero(static_cast<Eigen::Index>(rows.size()), ambient);
  Eigen::Index row = 0, column = 0;
  for (const int b : blocks) {
    const Block& block = map.block(b);
    charts.block(row, column, block.tangent_size(), block.size) =
        ChartOf(block, state.x.data() + block.offset);
    row += block.tangent_size();
    column += block.size;
  }
  Eigen::MatrixXd covariance = state.covariance(rows, rows);
  considered_covariance = state.covariance(considered, considered);
  if (!considered.empty()) {
    const Eigen::MatrixXd across = state.covariance(considered, rows);
    follow = considered_covariance.llt().solve(across).transpose();
    covariance -= follow * across;
  } else {
    follow.resize(covariance.rows(), 0);
  }
  llt.compute(covariance);
  A = llt.matrixL().solve(charts);
  mean = Ambient(map, state.x);
  cost = std::make_unique<LinearCost>(A, mean, sizes);
}

}  // namespace circline
