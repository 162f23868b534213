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
constexpr double kNoInformation = 1e-12;  // Of an eigenvalue, at unit diagonal.

// Inverse of a symmetric positive definite matrix. False where it is none.
bool Invert(const Eigen::MatrixXd& A, Eigen::MatrixXd* inverse) {
  const Eigen::LLT<Eigen::MatrixXd> llt(A);
  if (llt.info() != Eigen::Success) return false;
  *inverse = llt.solve(Eigen::MatrixXd::Identity(A.rows(), A.cols()));
  return inverse->allFinite();
}

// Pseudo-inverse on the observed subspace, which units do not matter to, and the directions without
// information. `diagonal`: what the information would be if all else were known.
bool PseudoInverse(const Eigen::MatrixXd& A, const Eigen::VectorXd& diagonal,
                   Eigen::MatrixXd* inverse, Eigen::MatrixXd* nulls) {
  const Eigen::VectorXd scale =
      diagonal.unaryExpr([](double d) { return d > 0.0 ? 1.0 / std::sqrt(d) : 1.0; });
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scale.asDiagonal() * A *
                                                             scale.asDiagonal());
  if (eigen.info() != Eigen::Success || !eigen.eigenvalues().allFinite()) return false;
  const Eigen::Index n = A.rows();
  Eigen::Index k = 0;
  while (k < n && eigen.eigenvalues()[k] <= kNoInformation) ++k;
  const Eigen::MatrixXd vectors = scale.asDiagonal() * eigen.eigenvectors();
  const auto known = eigen.eigenvalues().tail(n - k);
  *inverse = vectors.rightCols(n - k) * known.cwiseInverse().asDiagonal() *
             vectors.rightCols(n - k).transpose();
  *nulls = vectors.leftCols(k).colwise().normalized();
  return true;
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
    leaves_.push_back({next, size, {}, {}, {}});
    columns_[i] = next;
    next += size;
  }
  for (Arrow* arrow : {&information_, &overcounted_}) {
    arrow->core.setZero(core, core);
    for (const Leaf& leaf : leaves_)
      arrow->leaves.push_back(
          {Eigen::MatrixXd::Zero(leaf.size, leaf.size), Eigen::MatrixXd::Zero(leaf.size, core)});
  }
}

// A leaf's rows hold what is between it and the core, the core's do not.
void Linearization::Add(int row, int column, double value, Arrow* sum) const {
  const int core = core_size();
  if (row < core) {
    if (column < core) sum->core(row, column) += value;
    return;
  }
  const auto at = LeafAt(row);
  const int first = leaves_[at].first;
  if (column < core) {
    sum->leaves[at].with_core(row - first, column) += value;
  } else {
    sum->leaves[at].own(row - first, column - first) += value;
  }
}

// J^T J, at the places of its columns.
void Linearization::AddInformation(const Eigen::MatrixXd& J, const std::vector<int>& columns) {
  for (std::size_t a = 0; a < columns.size(); ++a) {
    for (std::size_t b = 0; b <= a; ++b) {
      const double sum =
          J.col(static_cast<Eigen::Index>(a)).dot(J.col(static_cast<Eigen::Index>(b)));
      Add(columns[a], columns[b], sum, &information_);
      if (a != b) Add(columns[b], columns[a], sum, &information_);
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
    const Eigen::MatrixXd H = rows->J.transpose() * rows->J;
    Eigen::MatrixXd more = (W * W - W) * H;
    if (term.lean_shape) {
      // J^T J is the plus Jacobian's P^T P over the variance of a direction's two components.
      const Eigen::MatrixXd& P = PlusJacobian(term.blocks.front());
      const Eigen::MatrixXd in_camera = problem_.PoseAt(state_).rotation * P;
      const double information = H.trace() / P.squaredNorm();
      more = W * W * information * in_camera.transpose() * *term.lean_shape * in_camera - W * H;
    }
    for (std::size_t a = 0; a < rows->columns.size(); ++a) {
      for (std::size_t b = 0; b < rows->columns.size(); ++b)
        Add(rows->columns[a], rows->columns[b],
            more(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b)), &overcounted_);
    }
  }
  rows->J *= std::sqrt(W);
  rows->f *= std::sqrt(W);
}

// A group's own unknowns out of the information of the shared ones.
bool Linearization::Eliminate(Group* group) {
  std::vector<int> target;
  for (const std::size_t index : group->rows) {
    for (const int column : rows_[index].columns) {
      if (column >= 0 &&
          std::find(group->shared.begin(), group->shared.end(), column) == group->shared.end())
        group->shared.push_back(column);
    }
  }
  const int k = group->size, n = static_cast<int>(group->shared.size());
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(k + n, k + n);
  for (const std::size_t index : group->rows) {
    const Rows& rows = rows_[index];
    target.clear();
    for (const int column : rows.columns)
      target.push_back(column < 0 ? -1 - column : k + IndexIn(group->shared, column));
    A(target, target) += rows.J.transpose() * rows.J;
  }
  if (k > 0) {
    if (!Invert(A.topLeftCorner(k, k), &group->inverse)) return false;
    group->gain = group->inverse.lazyProduct(A.topRightCorner(k, n));
    A.bottomRightCorner(n, n) -= A.bottomLeftCorner(n, k).lazyProduct(group->gain);
  }
  for (int a = 0; a < n; ++a) {
    for (int b = 0; b < n; ++b)
      Add(group->shared[static_cast<std::size_t>(a)], group->shared[static_cast<std::size_t>(b)],
          A(k + a, k + b), &information_);
  }
  return true;
}

// A leaf out of the core's information, and out of what is counted too much: with its unknowns
// measured from where they follow the core, that is M = L^T O L, L = [1 0; -gain 1].
bool Linearization::Eliminate(std::size_t index) {
  Leaf& leaf = leaves_[index];
  const auto& [own, with_core] = information_.leaves[index];
  const auto& [over_own, over_with_core] = overcounted_.leaves[index];
  Eigen::MatrixXd inverse, unused;
  if (!PseudoInverse(own, own.diagonal(), &inverse, &unused)) return false;
  leaf.gain = inverse * with_core;
  information_.core -= with_core.transpose() * leaf.gain;
  const Eigen::MatrixXd across = over_with_core - over_own * leaf.gain;
  overcounted_.core -= over_with_core.transpose() * leaf.gain + leaf.gain.transpose() * across;
  leaf.covariance = inverse + inverse * over_own * inverse;
  leaf.with_core = inverse * across;  // Times the core's covariance: ComputeCovariance.
  return true;
}

bool Linearization::ComputeCovariance() {
  for (Group& group : groups_) {
    if (ok_ && !group.rows.empty()) ok_ = Eliminate(&group);
  }
  if (!ok_) return false;
  const Eigen::VectorXd diagonal = information_.core.diagonal();
  for (std::size_t i = 0; i < leaves_.size(); ++i) {
    if (!Eliminate(i)) return false;
  }
  const int n = core_size(), e = num_estimated_, c = n - e;
  Eigen::MatrixXd inverse, nulls;
  if (!PseudoInverse(information_.core.topLeftCorner(e, e), diagonal.head(e), &inverse, &nulls))
    return false;
  covariance_.setZero(n, n);
  covariance_.topLeftCorner(e, e) =
      inverse + inverse * overcounted_.core.topLeftCorner(e, e) * inverse;
  null_space_ = nulls;
  for (Leaf& leaf : leaves_) {
    leaf.with_core.leftCols(e) *= inverse;
    leaf.with_core.rightCols(c).setZero();
  }
  if (c > 0) {
    const CameraSigma& sigma = problem_.camera_sigma();
    Eigen::VectorXd ambient = Eigen::VectorXd::Zero(kCameraSize);
    ambient << sigma.log_focal, sigma.log_aspect, sigma.principal_point_px,
        sigma.principal_point_px, sigma.k1, Eigen::VectorXd::Zero(kCameraSize - 5);
    const Eigen::MatrixXd P = PlusJacobian(JointProblem::kCamera);
    const Eigen::MatrixXd prior =
        P.transpose() * ambient.cwiseAbs2().asDiagonal() * P;  // P selects.
    const Eigen::MatrixXd follow = -inverse * information_.core.topRightCorner(e, c);
    covariance_.topLeftCorner(e, e) += follow * prior * follow.transpose();
    covariance_.topRightCorner(e, c) = follow * prior;
    covariance_.bottomLeftCorner(c, e) = covariance_.topRightCorner(e, c).transpose();
    covariance_.bottomRightCorner(c, c) = prior;
  }
  return covariance_.allFinite();
}

Eigen::MatrixXd Linearization::Covariance(const std::vector<int>& columns) const {
  const auto n = static_cast<Eigen::Index>(columns.size());
  const int core = core_size();
  Eigen::MatrixXd by_core = Eigen::MatrixXd::Zero(n, core), with_core = by_core;
  for (Eigen::Index i = 0; i < n; ++i) {
    const int column = columns[static_cast<std::size_t>(i)];
    if (column < core) {
      by_core(i, column) = 1.0;
      continue;
    }
    const Leaf& leaf = leaves_[LeafAt(column)];
    by_core.row(i) = -leaf.gain.row(column - leaf.first);
    with_core.row(i) = leaf.with_core.row(column - leaf.first);
  }
  const Eigen::MatrixXd across = with_core * by_core.transpose();
  Eigen::MatrixXd covariance =
      by_core * covariance_ * by_core.transpose() + across + across.transpose();
  for (Eigen::Index i = 0; i < n; ++i) {
    const int a = columns[static_cast<std::size_t>(i)];
    for (Eigen::Index j = 0; a >= core && j < n; ++j) {
      const int b = columns[static_cast<std::size_t>(j)];
      const Leaf& leaf = leaves_[LeafAt(a)];
      if (b >= core && LeafAt(b) == LeafAt(a))
        covariance(i, j) += leaf.covariance(a - leaf.first, b - leaf.first);
    }
  }
  return covariance;
}

double Linearization::OwnVariance(int block, int coordinate) const {
  const int group = problem_.blocks()[static_cast<std::size_t>(block)].group,
            own = own_columns_[static_cast<std::size_t>(block)] + coordinate;
  const Group& of = groups_[static_cast<std::size_t>(group)];
  return of.rows.empty() ? 0.0 : of.inverse(own, own);
}

}  // namespace circline
