#include "circline/refine/linearization.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
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
  for (const Term& term : problem.terms()) {
    if (problem.IsActive(term, state)) ok_ = ok_ && AddTerm(term, weighing);
  }
}

// Shared blocks of which no two meet in a feature or a prior: those of few first, so that what ties
// many is left to the core.
std::vector<bool> Linearization::FindLeaves() const {
  const std::vector<Block>& blocks = problem_.blocks();
  // By feature group, then by prior: the blocks that meet there.
  std::vector<std::vector<int>> meetings(static_cast<std::size_t>(problem_.num_groups()));
  std::vector<std::vector<std::size_t>> places(blocks.size());  // Of a block, in meetings.
  for (const Term& term : problem_.terms()) {
    std::size_t at = meetings.size();
    if (term.group >= 0) {
      at = static_cast<std::size_t>(term.group);
    } else {
      meetings.emplace_back();
    }
    for (const int block : term.blocks) {
      const Block& b = blocks[static_cast<std::size_t>(block)];
      std::vector<int>& here = meetings[at];
      if (block <= JointProblem::kCamera || b.group >= 0 || b.tangent_size() == 0 ||
          std::find(here.begin(), here.end(), block) != here.end())
        continue;
      here.push_back(block);
      places[static_cast<std::size_t>(block)].push_back(at);
    }
  }
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (!places[i].empty()) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return places[a].size() < places[b].size();
  });
  std::vector<bool> is_leaf(blocks.size(), false), is_taken(meetings.size(), false);
  for (const std::size_t i : order) {
    is_leaf[i] = std::none_of(places[i].begin(), places[i].end(),
                              [&](std::size_t at) { return is_taken[at]; });
    for (const std::size_t at : places[i]) is_taken[at] = is_taken[at] || is_leaf[i];
  }
  return is_leaf;
}

void Linearization::LayOut() {
  const std::vector<Block>& blocks = problem_.blocks();
  const std::vector<bool> is_leaf = FindLeaves();
  columns_.assign(blocks.size(), -1);
  own_columns_.assign(blocks.size(), -1);
  groups_.resize(static_cast<std::size_t>(problem_.num_groups()));
  plus_.resize(blocks.size());
  int next = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (i == JointProblem::kCamera || is_leaf[i]) continue;
    const int size = blocks[i].tangent_size();
    if (size == 0) continue;
    if (blocks[i].group >= 0) {
      Group& group = groups_[static_cast<std::size_t>(blocks[i].group)];
      own_columns_[i] = group.size;
      group.size += size;
    } else {
      columns_[i] = next;
      next += size;
    }
  }
  num_estimated_ = next;
  const CameraSigma& sigma = problem_.camera_sigma();
  if (sigma.log_focal > 0.0 || sigma.log_aspect > 0.0 || sigma.principal_point_px > 0.0 ||
      sigma.k1 > 0.0) {
    columns_[JointProblem::kCamera] = next;
    const Block& camera = blocks[JointProblem::kCamera];
    next += camera.manifold != nullptr ? camera.manifold->TangentSize() : camera.size;
    if (problem_.camera_is_estimated()) num_estimated_ = next;
  }
  const int core = next;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (!is_leaf[i]) continue;
    const int size = blocks[i].tangent_size();
    leaf_at_.insert(leaf_at_.end(), static_cast<std::size_t>(size),
                    static_cast<int>(leaves_.size()));
    leaves_.push_back({next, size, {}, {}, {}, {}});
    columns_[i] = next;
    next += size;
  }
  information_.core.setZero(core, core);
  for (const Leaf& leaf : leaves_)
    information_.leaves.push_back(
        {Eigen::MatrixXd::Zero(leaf.size, leaf.size), Eigen::MatrixXd::Zero(leaf.size, core)});
}

// A leaf's rows hold what is between it and the core, the core's do not.
void Linearization::Add(int row, int column, double value) {
  const int core = core_size();
  if (row < core) {
    if (column < core) information_.core(row, column) += value;
    return;
  }
  const auto at = LeafAt(row);
  const int first = leaves_[at].first;
  if (column < core) {
    information_.leaves[at].with_core(row - first, column) += value;
  } else {
    information_.leaves[at].own(row - first, column - first) += value;
  }
}

// J^T J, at the places of its columns.
void Linearization::AddInformation(const Eigen::MatrixXd& J, const std::vector<int>& columns) {
  for (std::size_t a = 0; a < columns.size(); ++a) {
    for (std::size_t b = 0; b <= a; ++b) {
      const double sum =
          J.col(static_cast<Eigen::Index>(a)).dot(J.col(static_cast<Eigen::Index>(b)));
      Add(columns[a], columns[b], sum);
      if (a != b) Add(columns[b], columns[a], sum);
    }
  }
}

const Eigen::MatrixXd& Linearization::PlusJacobian(int index) {
  Eigen::MatrixXd& plus = plus_[static_cast<std::size_t>(index)];
  if (plus.size() > 0) return plus;
  const Block& block = problem_.blocks()[static_cast<std::size_t>(index)];
  if (block.manifold == nullptr) return plus = Eigen::MatrixXd::Identity(block.size, block.size);
  RowMajor J(block.size, block.manifold->TangentSize());
  block.manifold->PlusJacobian(state_.x.data() + block.offset, J.data());
  return plus = J;
}

bool Linearization::AddTerm(const Term& term, const Weighing& weighing) {
  constexpr std::size_t kMaxBlocks = 8;
  const double* parameters[kMaxBlocks];
  double* jacobians[kMaxBlocks];
  problem_.Parameters(term, state_, parameters);
  const int num_rows = term.cost->num_residuals();
  Rows rows{term.feature, term.group, {}, {}, Eigen::VectorXd(num_rows), 0.0};
  std::size_t ambient_size = 0;
  for (const int index : term.blocks)
    ambient_size +=
        static_cast<std::size_t>(problem_.blocks()[static_cast<std::size_t>(index)].size);
  ambient_.resize(ambient_size * static_cast<std::size_t>(num_rows));
  double* next = ambient_.data();
  for (std::size_t k = 0; k < term.blocks.size(); ++k) {
    const auto block = static_cast<std::size_t>(term.blocks[k]);
    jacobians[k] = nullptr;
    if (columns_[block] < 0 && own_columns_[block] < 0) continue;
    jacobians[k] = next;
    next += num_rows * problem_.blocks()[block].size;
    const auto size = static_cast<int>(PlusJacobian(term.blocks[k]).cols());
    for (int c = 0; c < size; ++c)
      rows.columns.push_back(columns_[block] >= 0 ? columns_[block] + c
                                                  : -1 - (own_columns_[block] + c));
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
  rows.twice_cost = rows.f.squaredNorm();
  if (term.loss != nullptr && weighing.inliers_only) TakeLoss(term, &rows);
  if (term.group >= 0) {
    groups_[static_cast<std::size_t>(term.group)].rows.push_back(rows_.size());
  } else {
    AddInformation(rows.J, rows.columns);
  }
  rows_.push_back(std::move(rows));
  return true;
}

// The loss counts its residuals W times as much as their covariance C asks for, 1 or that of
// leaning walls: the estimate has the covariance A^-1 (A + J^T (W^2 C - W) J) A^-1, A with W J^T J.
void Linearization::TakeLoss(const Term& term, Rows* rows) {
  double rho[3];
  term.loss->Evaluate(rows->twice_cost, rho);
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

}  // namespace circline
