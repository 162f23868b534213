#include "circline/refine/track_prior.h"

#include <Eigen/Dense>
#include <cmath>

namespace circline {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace

// Where phi has the translation and the focal length; -1: not charted, not an unknown.
struct Charted {
  Eigen::Index translation = -1, camera = -1;

  // In place. False where the origin is not before the camera.
  bool Map(Scratch::Vector* x) const {
    if (translation < 0) return true;
    const double log_focal = camera >= 0 ? (*x)[camera] : 0.0;
    const Eigen::Vector3d t = x->segment<3>(translation);
    if (!(t.z() > 0.0)) return false;
    const double f = std::exp(log_focal);
    x->segment<3>(translation) << f * t.x() / t.z(), f * t.y() / t.z(), std::log(t.z()) - log_focal;
    return true;
  }
  // Of the translation's rows by the translation and the logarithm of the focal length, at x.
  Eigen::Matrix<double, 3, 4> Slope(const Scratch::Vector& x) const {
    const double f = camera >= 0 ? std::exp(x[camera]) : 1.0;
    const Eigen::Vector3d t = x.segment<3>(translation);
    Eigen::Matrix<double, 3, 4> slope;
    slope << f / t.z(), 0.0, -f * t.x() / (t.z() * t.z()), f * t.x() / t.z(),  //
        0.0, f / t.z(), -f * t.y() / (t.z() * t.z()), f * t.y() / t.z(),       //
        0.0, 0.0, 1.0 / t.z(), -1.0;
    return slope;
  }
  // From derivatives by phi to those by x, and back.
  void ToX(const Scratch::Vector& x, Scratch::Matrix* J) const {
    if (translation < 0) return;
    const Eigen::Matrix<double, 3, 4> slope = Slope(x);
    if (camera >= 0) J->col(camera) += J->middleCols<3>(translation) * slope.col(3);
    TurnColumns(slope.leftCols<3>(), J);
  }
  // The same of one block's columns of A, those from `first` on, which J has.
  void ToX(const Scratch::Vector& x, const Scratch::Matrix& A, Eigen::Index first,
           Eigen::Map<RowMajor>* J) const {
    if (translation < 0) return;
    const auto by_phi = A.middleCols<3>(translation);
    if (first == translation) J->noalias() = by_phi * Slope(x).leftCols<3>();
    if (first == camera) J->col(0) += by_phi * Slope(x).col(3);
  }
  void ToPhi(const Scratch::Vector& x, Scratch::Matrix* J) const {
    if (translation < 0) return;
    const Eigen::Matrix<double, 3, 4> slope = Slope(x);
    TurnColumns(slope.leftCols<3>().inverse(), J);
    if (camera >= 0) J->col(camera) -= J->middleCols<3>(translation) * slope.col(3);
  }
  void TurnColumns(const Eigen::Matrix3d& by, Scratch::Matrix* J) const {
    for (Eigen::Index i = 0; i < J->rows(); ++i) {
      const Eigen::RowVector3d row = J->row(i).segment<3>(translation);
      J->row(i).segment<3>(translation) = row * by;
    }
  }
};

// Residuals A (phi(x) - phi(mean)) of several blocks.
class TrackPrior::ChartedCost final : public ceres::CostFunction {
 public:
  void Reset(const TrackMap& map, const TrackPrior& prior, const Charted& chart) {
    charted = chart;
    mutable_parameter_block_sizes()->clear();
    for (const int b : prior.blocks) mutable_parameter_block_sizes()->push_back(map.block(b).size);
    set_num_residuals(static_cast<int>(prior.rows.size()));
  }
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    Eigen::Index first = 0;
    for (std::size_t k = 0; k < parameter_block_sizes().size(); ++k) {
      const int size = parameter_block_sizes()[k];
      x.segment(first, size) = Eigen::Map<const Eigen::VectorXd>(parameters[k], size);
      first += size;
    }
    phi = x;
    if (!charted.Map(&phi)) return false;
    phi -= mean;
    Eigen::Map<Eigen::VectorXd>(residuals, A.rows()).noalias() = A * phi;
    if (jacobians == nullptr) return true;
    first = 0;
    for (std::size_t k = 0; k < parameter_block_sizes().size(); ++k) {
      const int size = parameter_block_sizes()[k];
      if (jacobians[k] != nullptr) {
        Eigen::Map<RowMajor> J(jacobians[k], A.rows(), size);
        J = A.middleCols(first, size);
        charted.ToX(x, A, first, &J);
      }
      first += size;
    }
    return true;
  }

  Scratch::Matrix A{nullptr, 0, 0};
  Scratch::Vector mean{nullptr, 0};
  mutable Scratch::Vector x{nullptr, 0}, phi{nullptr, 0};
  Charted charted;
};

namespace {

void Raw(const TrackMap& map, const std::vector<int>& blocks, const Eigen::VectorXd& x,
         Scratch::Vector* out) {
  Eigen::Index next = 0;
  for (const int b : blocks) {
    const Block& block = map.block(b);
    out->segment(next, block.size) = x.segment(block.offset, block.size);
    next += block.size;
  }
}

}  // namespace

TrackPrior::TrackPrior() : cost_(std::make_unique<ChartedCost>()) {}
TrackPrior::~TrackPrior() = default;
ceres::CostFunction* TrackPrior::cost() const { return cost_.get(); }

void TrackPrior::Difference(const TrackMap& map, const Eigen::VectorXd& x,
                            Scratch::Vector* out) const {
  Raw(map, blocks, x, out);
  if (!cost_->charted.Map(out)) out->setConstant(std::nan(""));
  *out -= cost_->mean;
}

double TrackPrior::TwiceCost(const TrackMap& map, const Eigen::VectorXd& x) const {
  const Scratch::Scope scope(&scratch_);
  Scratch::Vector difference = scratch_.NewVector(charts.cols()),
                  z = scratch_.NewVector(charts.rows());
  Difference(map, x, &difference);
  z.noalias() = cost_->A * difference;
  return z.squaredNorm();
}

void TrackPrior::Moved(const TrackMap& map, const Eigen::VectorXd& x,
                       Scratch::Vector* moved) const {
  const Scratch::Scope scope(&scratch_);
  Scratch::Vector difference = scratch_.NewVector(charts.cols());
  Difference(map, x, &difference);
  moved->noalias() = charts * difference;
}

void TrackPrior::ChartsAt(const TrackMap& map, const Eigen::VectorXd& x,
                          Scratch::Matrix* out) const {
  const Scratch::Scope scope(&scratch_);
  Scratch::Vector raw = scratch_.NewVector(charts.cols());
  Raw(map, blocks, x, &raw);
  *out = charts;
  cost_->charted.ToX(raw, out);
}

bool TrackPrior::Reset(const TrackMap& map, const TrackState& state,
                       const std::vector<std::uint8_t>& used) {
  blocks.clear();
  rows.clear();
  considered.clear();
  Charted charted;
  Eigen::Index ambient = 0;
  for (int b = 0; b < map.size(); ++b) {
    const Block& block = map.block(b);
    if (used[static_cast<std::size_t>(b)] == 0 || block.tangent_size() == 0) continue;
    const bool is_considered = b == TrackMap::kCamera && map.camera_is_considered;
    for (int k = 0; k < block.tangent_size(); ++k)
      (is_considered ? considered : rows).push_back(map.tangent(b) + k);
    if (is_considered) continue;
    blocks.push_back(b);
    if (b == TrackMap::kCamera) charted.camera = ambient;
    // An origin that is seen at its side, or from behind, has no such chart.
    constexpr double kBefore = 0.3;  // Cosine.
    const double* t = state.x.data() + block.offset;
    if (b == TrackMap::kTranslation && t[2] > kBefore * std::hypot(t[0], t[1], t[2]))
      charted.translation = ambient;
    ambient += block.size;
  }
  const auto n = static_cast<Eigen::Index>(rows.size()),
             c = static_cast<Eigen::Index>(considered.size());
  scratch_.Clear();
  Rebind(scratch_.NewMatrix(n, ambient), &charts);
  Rebind(scratch_.NewMatrix(n, n), &root);
  Rebind(scratch_.NewMatrix(n, c), &follow);
  Rebind(scratch_.NewMatrix(c, c), &considered_covariance);
  Rebind(scratch_.NewMatrix(n, ambient), &cost_->A);
  for (Scratch::Vector* vector : {&cost_->mean, &cost_->x, &cost_->phi})
    Rebind(scratch_.NewVector(ambient), vector);
  cost_->Reset(map, *this, charted);

  charts.setZero();
  Eigen::Index row = 0, column = 0;
  for (const int b : blocks) {
    const Block& block = map.block(b);
    charts.block(row, column, block.tangent_size(), block.size) =
        block.Chart(state.x.data() + block.offset);
    row += block.tangent_size();
    column += block.size;
  }
  Gather(state.covariance, rows, rows, &root);
  Gather(state.covariance, considered, considered, &considered_covariance);
  if (c > 0) {
    const Scratch::Scope scope(&scratch_);
    Scratch::Matrix across = scratch_.NewMatrix(c, n), gain = scratch_.NewMatrix(c, n),
                    camera = scratch_.NewMatrix(c, c);
    Gather(state.covariance, considered, rows, &across);
    camera = considered_covariance;
    if (!FactorInPlace(camera)) return false;
    gain = across;
    SolveInPlace(camera, gain);
    follow = gain.transpose();
    root.noalias() -= follow * across;
  }
  if (!FactorInPlace(root)) return false;
  Raw(map, blocks, state.x, &cost_->x);
  cost_->charted.ToPhi(cost_->x, &charts);
  cost_->A = charts;
  HalfSolveInPlace(root, cost_->A);
  cost_->mean = cost_->x;
  return charted.Map(&cost_->mean);
}

}  // namespace circline
