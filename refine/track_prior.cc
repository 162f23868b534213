#include "circline/refine/track_prior.h"

#include <Eigen/LU>
#include <cmath>
#include <utility>

namespace circline {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Where phi has the translation and the focal length.
struct Charted {
  Eigen::Index translation = -1, camera = -1;

  // In place. False where the origin is not before the camera.
  bool Map(Eigen::VectorXd* x) const {
    if (translation < 0) return true;
    const double log_focal = camera >= 0 ? (*x)[camera] : 0.0;
    const Eigen::Vector3d t = x->segment<3>(translation);
    if (!(t.z() > 0.0)) return false;
    const double f = std::exp(log_focal);
    x->segment<3>(translation) << f * t.x() / t.z(), f * t.y() / t.z(), std::log(t.z()) - log_focal;
    return true;
  }
  // Of the translation's rows by the translation and the logarithm of the focal length, at x.
  Eigen::Matrix<double, 3, 4> Slope(const Eigen::VectorXd& x) const {
    const double f = camera >= 0 ? std::exp(x[camera]) : 1.0;
    const Eigen::Vector3d t = x.segment<3>(translation);
    Eigen::Matrix<double, 3, 4> slope;
    slope << f / t.z(), 0.0, -f * t.x() / (t.z() * t.z()), f * t.x() / t.z(),  //
        0.0, f / t.z(), -f * t.y() / (t.z() * t.z()), f * t.y() / t.z(),       //
        0.0, 0.0, 1.0 / t.z(), -1.0;
    return slope;
  }
  // From derivatives by phi to those by x, and back.
  void ToX(const Eigen::VectorXd& x, Eigen::MatrixXd* J) const {
    if (translation < 0) return;
    const Eigen::Matrix<double, 3, 4> slope = Slope(x);
    if (camera >= 0) J->col(camera) += J->middleCols<3>(translation) * slope.col(3);
    J->middleCols<3>(translation) *= slope.leftCols<3>();
  }
  // The same of one block's columns of A, those from `first` on, which J has.
  void ToX(const Eigen::VectorXd& x, const Eigen::MatrixXd& A, Eigen::Index first,
           Eigen::Map<RowMajor>* J) const {
    if (translation < 0) return;
    const auto by_phi = A.middleCols<3>(translation);
    if (first == translation) J->noalias() = by_phi * Slope(x).leftCols<3>();
    if (first == camera) J->col(0) += by_phi * Slope(x).col(3);
  }
  void ToPhi(const Eigen::VectorXd& x, Eigen::MatrixXd* J) const {
    if (translation < 0) return;
    const Eigen::Matrix<double, 3, 4> slope = Slope(x);
    J->middleCols<3>(translation) *= slope.leftCols<3>().inverse().eval();
    if (camera >= 0) J->col(camera) -= J->middleCols<3>(translation) * slope.col(3);
  }
};

// Residuals A (phi(x) - phi(mean)) of several blocks.
class ChartedCost final : public ceres::CostFunction {
 public:
  ChartedCost(Eigen::MatrixXd A, Eigen::VectorXd mean, const std::vector<int>& sizes,
              const Charted& charted)
      : A_(std::move(A)), mean_(std::move(mean)), charted_(charted) {
    *mutable_parameter_block_sizes() = sizes;
    set_num_residuals(static_cast<int>(A_.rows()));
  }
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    Eigen::VectorXd x(A_.cols());
    Eigen::Index first = 0;
    for (std::size_t k = 0; k < parameter_block_sizes().size(); ++k) {
      const int size = parameter_block_sizes()[k];
      x.segment(first, size) = Eigen::Map<const Eigen::VectorXd>(parameters[k], size);
      first += size;
    }
    Eigen::VectorXd phi = x;
    if (!charted_.Map(&phi)) return false;
    Eigen::Map<Eigen::VectorXd>(residuals, A_.rows()).noalias() = A_ * (phi - mean_);
    if (jacobians == nullptr) return true;
    first = 0;
    for (std::size_t k = 0; k < parameter_block_sizes().size(); ++k) {
      const int size = parameter_block_sizes()[k];
      if (jacobians[k] != nullptr) {
        Eigen::Map<RowMajor> J(jacobians[k], A_.rows(), size);
        J = A_.middleCols(first, size);
        charted_.ToX(x, A_, first, &J);
      }
      first += size;
    }
    return true;
  }

 private:
  Eigen::MatrixXd A_;
  Eigen::VectorXd mean_;
  Charted charted_;
};

}  // namespace

Eigen::VectorXd TrackPrior::Raw(const TrackMap& map, const Eigen::VectorXd& x) const {
  Eigen::VectorXd out(charts.cols());
  Eigen::Index next = 0;
  for (const int b : blocks) {
    out.segment(next, map.block(b).size) = x.segment(map.block(b).offset, map.block(b).size);
    next += map.block(b).size;
  }
  return out;
}

Eigen::VectorXd TrackPrior::Ambient(const TrackMap& map, const Eigen::VectorXd& x) const {
  Eigen::VectorXd phi = Raw(map, x);
  if (!Charted{translation_, camera_}.Map(&phi)) phi.setConstant(std::nan(""));
  return phi;
}

Eigen::MatrixXd TrackPrior::ChartsAt(const TrackMap& map, const Eigen::VectorXd& x) const {
  Eigen::MatrixXd out = charts;
  Charted{translation_, camera_}.ToX(Raw(map, x), &out);
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
    if (b == TrackMap::kCamera) camera_ = ambient;
    // An origin that is seen at its side, or from behind, has no such chart.
    constexpr double kBefore = 0.3;  // Cosine.
    const double* t = state.x.data() + block.offset;
    if (b == TrackMap::kTranslation && t[2] > kBefore * std::hypot(t[0], t[1], t[2]))
      translation_ = ambient;
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
  mean = Ambient(map, state.x);
  Charted{translation_, camera_}.ToPhi(Raw(map, state.x), &charts);
  A = llt.matrixL().solve(charts);
  cost = std::make_unique<ChartedCost>(A, mean, sizes, Charted{translation_, camera_});
}

}  // namespace circline
