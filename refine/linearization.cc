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

// Which shared blocks but the pose's and the camera's meet in a feature or a prior.
struct Meetings {
  std::vector<std::vector<int>> blocks;          // Of each meeting.
  std::vector<std::vector<std::size_t>> places;  // By block: the meetings.
};

Meetings FindMeetings(const JointProblem& problem) {
  const std::vector<Block>& blocks = problem.blocks();
  // By feature group, then by prior.
  Meetings all;
  all.blocks.resize(static_cast<std::size_t>(problem.num_groups()));
  all.places.resize(blocks.size());
  for (const Term& term : problem.terms()) {
    std::size_t at = all.blocks.size();
    if (term.group >= 0) {
      at = static_cast<std::size_t>(term.group);
    } else {
      all.blocks.emplace_back();
    }
    for (const int block : term.blocks) {
      const Block& b = blocks[static_cast<std::size_t>(block)];
      std::vector<int>& here = all.blocks[at];
      if (block <= JointProblem::kCamera || b.group >= 0 || b.tangent_size() == 0 ||
          std::find(here.begin(), here.end(), block) != here.end())
        continue;
      here.push_back(block);
      all.places[static_cast<std::size_t>(block)].push_back(at);
    }
  }
  return all;
}

}  // namespace

Linearization::Linearization(const JointProblem& problem, const State& state,
                             const Weighing& weighing)
    : problem_(problem), state_(state) {
  LayOut();
  for (const Term& term : problem.terms()) {
    if (problem.IsActive(term, state)) ok_ = ok_ && AddTerm(term, weighing);
  }
}

// Shared blocks, together where they meet: those of few meetings first, so that what ties many is
// left to the core, and so is what would make a leaf too large.
std::vector<std::vector<int>> Linearization::FindLeaves() const {
  const std::vector<Block>& blocks = problem_.blocks();
  const Meetings all = FindMeetings(problem_);
  const std::vector<std::vector<int>>& meetings = all.blocks;
  const std::vector<std::vector<std::size_t>>& places = all.places;
  std::vector<int> order;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (!places[i].empty()) order.push_back(static_cast<int>(i));
  }
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return places[static_cast<std::size_t>(a)].size() < places[static_cast<std::size_t>(b)].size();
  });
  // A larger leaf costs its size cubed, smaller ones a larger core (not tuned).
  constexpr int kLargest = 100;
  std::vector<std::vector<int>> leaves;
  std::vector<int> leaf_of(blocks.size(), -1);
  for (const int i : order) {
    std::vector<int> joined, together = {i};
    constexpr std::size_t kMostJoined = 2;  // Those of a chain.
    for (const std::size_t at : places[static_cast<std::size_t>(i)]) {
      if (joined.size() > kMostJoined) break;
      for (const int other : meetings[at]) {
        const int leaf = leaf_of[static_cast<std::size_t>(other)];
        if (leaf < 0 || std::find(joined.begin(), joined.end(), leaf) != joined.end()) continue;
        joined.push_back(leaf);
        const auto& members = leaves[static_cast<std::size_t>(leaf)];
        together.insert(together.end(), members.begin(), members.end());
      }
    }
    int size = 0;
    for (const int block : together) size += blocks[static_cast<std::size_t>(block)].tangent_size();
    if (joined.size() > kMostJoined || size > kLargest) continue;
    if (joined.empty()) {
      joined.push_back(static_cast<int>(leaves.size()));
      leaves.emplace_back();
    }
    for (const int leaf : joined) leaves[static_cast<std::size_t>(leaf)].clear();
    for (const int block : together) leaf_of[static_cast<std::size_t>(block)] = joined.front();
    leaves[static_cast<std::size_t>(joined.front())] = std::move(together);
  }
  return leaves;
}

void Linearization::LayOut() {
  const std::vector<Block>& blocks = problem_.blocks();
  const std::vector<std::vector<int>> leaves = FindLeaves();
  std::vector<bool> is_in_leaf(blocks.size(), false);
  for (const std::vector<int>& leaf : leaves) {
    for (const int block : leaf) is_in_leaf[static_cast<std::size_t>(block)] = true;
  }
  columns_.assign(blocks.size(), -1);
  own_columns_.assign(blocks.size(), -1);
  groups_.resize(static_cast<std::size_t>(problem_.num_groups()));
  plus_.resize(blocks.size());
  int next = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (i == JointProblem::kCamera || is_in_leaf[i]) continue;
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
  for (const std::vector<int>& members : leaves) {
    if (members.empty()) continue;
    Leaf leaf;
    leaf.first = next;
    for (const int block : members) {
      columns_[static_cast<std::size_t>(block)] = next;
      next += blocks[static_cast<std::size_t>(block)].tangent_size();
    }
    leaf.size = next - leaf.first;
    leaf_at_.insert(leaf_at_.end(), static_cast<std::size_t>(leaf.size),
                    static_cast<int>(leaves_.size()));
    leaves_.push_back(std::move(leaf));
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
  constexpr std::size_t kMostColumns = 20;  // Of nearly all.
  rows.columns.reserve(kMostColumns);
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
