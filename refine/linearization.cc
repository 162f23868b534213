#include "circline/refine/linearization.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "circline/refine/block_chain.h"

namespace circline {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

}  // namespace

Linearization::Linearization(const JointProblem& problem, const State& state,
                             const Weighing& weighing)
    : problem_(problem), state_(state) {
  LayOut();
  together_.resize(static_cast<std::size_t>(problem.num_groups()));
  for (const Term& term : problem.terms()) {
    if (problem.IsActive(term, state)) ok_ = ok_ && AddTerm(term, weighing);
  }
}

void Linearization::LayOut() {
  const std::vector<Block>& blocks = problem_.blocks();
  columns_.assign(blocks.size(), -1);
  plus_.resize(blocks.size());
  const auto add = [&](int block, int size) {
    if (size == 0 || column(block) >= 0) return;
    columns_[static_cast<std::size_t>(block)] = static_cast<int>(groups_.size());
    groups_.resize(groups_.size() + static_cast<std::size_t>(size),
                   blocks[static_cast<std::size_t>(block)].group);
  };
  for (const int block : {JointProblem::kRotation, JointProblem::kTranslation})
    add(block, blocks[static_cast<std::size_t>(block)].tangent_size());
  num_estimated_ = static_cast<int>(groups_.size());
  const CameraSigma& sigma = problem_.camera_sigma();
  if (sigma.log_focal > 0.0 || sigma.log_aspect > 0.0 || sigma.principal_point_px > 0.0 ||
      sigma.k1 > 0.0) {
    const Block& camera = blocks[JointProblem::kCamera];
    add(JointProblem::kCamera,
        camera.manifold != nullptr ? camera.manifold->TangentSize() : camera.size);
  }
  core_size_ = static_cast<int>(groups_.size());
  if (problem_.camera_is_estimated()) num_estimated_ = core_size_;
  for (const Term& term : problem_.terms()) {
    if (!problem_.IsActive(term, state_)) continue;
    for (const int block : term.blocks)
      add(block, blocks[static_cast<std::size_t>(block)].tangent_size());
  }
}

const Eigen::MatrixXd& Linearization::PlusJacobian(int index) {
  Eigen::MatrixXd& plus = plus_[static_cast<std::size_t>(index)];
  const Block& block = problem_.block(index);
  if (plus.size() == 0) plus = block.PlusJacobian(state_.x.data() + block.offset);
  return plus;
}

bool Linearization::AddTerm(const Term& term, const Weighing& weighing) {
  constexpr std::size_t kMaxBlocks = 8;
  const double* parameters[kMaxBlocks];
  double* jacobians[kMaxBlocks];
  problem_.Parameters(term, state_, parameters);
  const int num_rows = term.cost->num_residuals();
  Rows rows{term.feature, {}, {}, Eigen::VectorXd(num_rows)};
  constexpr std::size_t kMostColumns = 20;  // Of nearly all.
  rows.columns.reserve(kMostColumns);
  std::size_t ambient_size = 0;
  for (const int index : term.blocks)
    ambient_size += static_cast<std::size_t>(problem_.block(index).size);
  ambient_.resize(ambient_size * static_cast<std::size_t>(num_rows));
  double* next = ambient_.data();
  for (std::size_t k = 0; k < term.blocks.size(); ++k) {
    const int block = term.blocks[k];
    jacobians[k] = nullptr;
    if (column(block) < 0) continue;
    jacobians[k] = next;
    next += num_rows * problem_.block(block).size;
    const auto size = static_cast<int>(PlusJacobian(block).cols());
    for (int c = 0; c < size; ++c) rows.columns.push_back(column(block) + c);
  }
  const bool evaluated =
      term.weighed != nullptr
          ? term.weighed->EvaluateWith(weighing, parameters, rows.f.data(), jacobians)
          : term.cost->Evaluate(parameters, rows.f.data(), jacobians);
  if (!evaluated) return false;
  rows.J.resize(num_rows, static_cast<Eigen::Index>(rows.columns.size()));
  Eigen::Index first = 0;
  for (std::size_t k = 0; k < term.blocks.size(); ++k) {
    if (jacobians[k] == nullptr) continue;
    const Eigen::MatrixXd& plus = PlusJacobian(term.blocks[k]);
    const Eigen::Map<const RowMajor> ambient(jacobians[k], num_rows, plus.rows());
    rows.J.middleCols(first, plus.cols()) = ambient.lazyProduct(plus);
    first += plus.cols();
  }
  if (term.loss != nullptr && weighing.inliers_only) TakeLoss(term, rows.f.squaredNorm(), &rows);
  if (term.group < 0) together_.emplace_back();
  (term.group < 0 ? together_.back() : together_[static_cast<std::size_t>(term.group)])
      .push_back(rows_.size());
  rows_.push_back(std::move(rows));
  return true;
}

// The loss counts its residuals W times as much as their covariance C asks for, 1 or that of
// leaning walls: the estimate has the covariance A^-1 (A + J^T (W^2 C - W) J) A^-1, A with W J^T J.
void Linearization::TakeLoss(const Term& term, double twice_cost, Rows* rows) {
  double rho[3];
  term.loss->Evaluate(twice_cost, rho);
  const double W = std::max(1.0, rho[1]);
  if (term.is_mostly_exact) {
    Overcounted over{rows->columns, rows->J, {}};
    double information = 1.0;
    Eigen::MatrixXd C = Eigen::MatrixXd::Identity(over.F.rows(), over.F.rows());
    if (term.lean_shape) {
      // J^T J is the plus Jacobian's P^T P over the variance of a direction's two components.
      const Eigen::MatrixXd& P = PlusJacobian(term.blocks.front());
      over.F = problem_.PoseAt(state_).rotation * P;
      information = rows->J.squaredNorm() / P.squaredNorm();
      C = *term.lean_shape;
    }
    over.S = W * information * (W * C - Eigen::MatrixXd::Identity(C.rows(), C.rows()));
    overcounted_.push_back(std::move(over));
  }
  rows->J *= std::sqrt(W);
  rows->f *= std::sqrt(W);
}

// One below the other, by all of their columns.
Linearization::Rows Linearization::Together(const std::vector<std::size_t>& parts) const {
  Rows all;
  Eigen::Index num_rows = 0;
  for (const std::size_t part : parts) {
    num_rows += rows_[part].J.rows();
    for (const int column : rows_[part].columns) {
      if (std::find(all.columns.begin(), all.columns.end(), column) == all.columns.end())
        all.columns.push_back(column);
    }
  }
  all.J.setZero(num_rows, static_cast<Eigen::Index>(all.columns.size()));
  all.f.resize(num_rows);
  Eigen::Index first = 0;
  for (const std::size_t part : parts) {
    const Rows& rows = rows_[part];
    for (std::size_t c = 0; c < rows.columns.size(); ++c) {
      const auto at = std::find(all.columns.begin(), all.columns.end(), rows.columns[c]);
      all.J.col(at - all.columns.begin()).segment(first, rows.J.rows()) =
          rows.J.col(static_cast<Eigen::Index>(c));
    }
    all.f.segment(first, rows.f.size()) = rows.f;
    first += rows.J.rows();
  }
  return all;
}

double Linearization::OwnVariance(int block, int coordinate) const {
  const int group = problem_.block(block).group;
  const Rows all = Together(together_[static_cast<std::size_t>(group)]);
  std::vector<Eigen::Index> own;
  Eigen::Index at = -1;
  for (std::size_t c = 0; c < all.columns.size(); ++c) {
    if (groups_[static_cast<std::size_t>(all.columns[c])] != group) continue;
    if (all.columns[c] == column(block) + coordinate) at = static_cast<Eigen::Index>(own.size());
    own.push_back(static_cast<Eigen::Index>(c));
  }
  if (at < 0) return 0.0;
  const Eigen::MatrixXd J = all.J(Eigen::all, own);
  return (J.transpose() * J).inverse()(at, at);
}

}  // namespace circline
