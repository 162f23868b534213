#include "circline/refine/track/track_prior.h"

#include <Eigen/Dense>
#include <cmath>

#include "circline/refine/block_chain.h"

namespace circline {

// phi of x, in its place. False where the origin is not before the camera.
bool TrackPrior::Chart(Scratch::Vector* x) const {
  if (translation_ < 0) return true;
  const double log_focal = camera_ >= 0 ? (*x)[camera_] : 0.0;
  const Eigen::Vector3d t = x->segment<3>(translation_);
  if (!(t.z() > 0.0)) return false;
  const double f = std::exp(log_focal);
  x->segment<3>(translation_) << f * t.x() / t.z(), f * t.y() / t.z(), std::log(t.z()) - log_focal;
  return true;
}

// Derivatives of phi's translation by that of x and the logarithm of the focal length, at x.
Eigen::Matrix<double, 3, 4> TrackPrior::Slope(const Scratch::Vector& x) const {
  const double f = camera_ >= 0 ? std::exp(x[camera_]) : 1.0;
  const Eigen::Vector3d t = x.segment<3>(translation_);
  Eigen::Matrix<double, 3, 4> slope;
  slope << f / t.z(), 0.0, -f * t.x() / (t.z() * t.z()), f * t.x() / t.z(),  //
      0.0, f / t.z(), -f * t.y() / (t.z() * t.z()), f * t.y() / t.z(),       //
      0.0, 0.0, 1.0 / t.z(), -1.0;
  return slope;
}

// The translation's columns times a matrix.
void TrackPrior::TurnTranslation(const Eigen::Matrix3d& by, Scratch::Matrix* J) const {
  for (Eigen::Index i = 0; i < J->rows(); ++i) {
    const Eigen::RowVector3d row = J->row(i).segment<3>(translation_);
    J->row(i).segment<3>(translation_) = row * by;
  }
}

bool TrackPrior::Residuals(const double* const* parameters, double* z, Scratch::Matrix* J) const {
  Eigen::Index first = 0;
  for (std::size_t k = 0; k < blocks.size(); ++k) {
    const int size = parameter_block_sizes()[k];
    x_.segment(first, size) = Eigen::Map<const Eigen::VectorXd>(parameters[k], size);
    first += size;
  }
  phi_ = x_;
  if (!Chart(&phi_)) return false;
  phi_ -= mean_;
  Eigen::Map<Eigen::VectorXd>(z, A_.rows()).noalias() = A_ * phi_;
  if (J == nullptr) return true;
  *J = A_;
  if (translation_ < 0) return true;
  const Eigen::Matrix<double, 3, 4> slope = Slope(x_);
  if (camera_ >= 0) J->col(camera_) += A_.middleCols<3>(translation_) * slope.col(3);
  TurnTranslation(slope.leftCols<3>(), J);
  return true;
}

bool TrackPrior::Evaluate(const double* const* parameters, double* residuals,
                          double** jacobians) const {
  if (!Residuals(parameters, residuals, jacobians != nullptr ? &J_ : nullptr)) return false;
  Eigen::Index first = 0;
  for (std::size_t k = 0; jacobians != nullptr && k < blocks.size(); ++k) {
    const int size = parameter_block_sizes()[k];
    if (jacobians[k] != nullptr)
      Eigen::Map<RowMajor>(jacobians[k], J_.rows(), size) = J_.middleCols(first, size);
    first += size;
  }
  return true;
}

bool TrackPrior::Reset(const TrackMap& map, const TrackState& state,
                       const std::vector<std::uint8_t>& used) {
  blocks.clear();
  rows.clear();
  considered.clear();
  translation_ = camera_ = -1;
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
    if (b == TrackMap::kCamera) camera_ = ambient;
    // An origin that is seen at its side, or from behind, has no such chart.
    constexpr double kBefore = 0.3;  // Cosine.
    const double* t = state.x.data() + block.offset;
    if (b == TrackMap::kTranslation && t[2] > kBefore * std::hypot(t[0], t[1], t[2]))
      translation_ = ambient;
    ambient += block.size;
  }
  const auto n = static_cast<Eigen::Index>(rows.size()),
             c = static_cast<Eigen::Index>(considered.size());
  set_num_residuals(static_cast<int>(n));
  scratch_.Clear();
  Rebind(scratch_.NewMatrix(n, n), &root);
  Rebind(scratch_.NewMatrix(n, c), &follow);
  Rebind(scratch_.NewMatrix(c, c), &considered_covariance);
  for (Scratch::Matrix* matrix : {&A_, &J_}) Rebind(scratch_.NewMatrix(n, ambient), matrix);
  for (Scratch::Vector* vector : {&mean_, &x_, &phi_}) Rebind(scratch_.NewVector(ambient), vector);

  A_.setZero();
  Eigen::Index row = 0, column = 0;
  for (const int b : blocks) {
    const Block& block = map.block(b);
    const double* values = state.x.data() + block.offset;
    A_.block(row, column, block.tangent_size(), block.size) = block.Chart(values);
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
  if (translation_ >= 0) {  // M is by phi.
    const Eigen::Matrix<double, 3, 4> slope = Slope(mean_);
    TurnTranslation(slope.leftCols<3>().inverse(), &A_);
    if (camera_ >= 0) A_.col(camera_) -= A_.middleCols<3>(translation_) * slope.col(3);
  }
  HalfSolveInPlace(root, A_);
  return Chart(&mean_);
}

}  // namespace circline
