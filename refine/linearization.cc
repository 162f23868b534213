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
// information.
bool PseudoInverse(const Eigen::MatrixXd& A, Eigen::MatrixXd* inverse, Eigen::MatrixXd* nulls) {
  const Eigen::VectorXd scale =
      A.diagonal().unaryExpr([](double d) { return d > 0.0 ? 1.0 / std::sqrt(d) : 1.0; });
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

// J^T J, at the places of its columns.
void AddInformation(const Eigen::MatrixXd& J, const std::vector<int>& target,
                    Eigen::MatrixXd* information) {
  for (std::size_t a = 0; a < target.size(); ++a) {
    for (std::size_t b = 0; b <= a; ++b) {
      const double sum =
          J.col(static_cast<Eigen::Index>(a)).dot(J.col(static_cast<Eigen::Index>(b)));
      (*information)(target[a], target[b]) += sum;
      if (a != b) (*information)(target[b], target[a]) += sum;
    }
  }
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

void Linearization::LayOut() {
  const std::vector<Block>& blocks = problem_.blocks();
  columns_.assign(blocks.size(), -1);
  own_columns_.assign(blocks.size(), -1);
  groups_.resize(static_cast<std::size_t>(problem_.num_groups()));
  plus_.resize(blocks.size());
  int next = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    if (i == JointProblem::kCamera) continue;
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
  information_.setZero(next, next);
  overcounted_.setZero(next, next);
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
    AddInformation(rows.J, rows.columns, &information_);
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
    overcounted_(rows->columns, rows->columns) += more;
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
    AddInformation(rows.J, target, &A);
  }
  if (k > 0) {
    if (!Invert(A.topLeftCorner(k, k), &group->inverse)) return false;
    group->gain = group->inverse.lazyProduct(A.topRightCorner(k, n));
    A.bottomRightCorner(n, n) -= A.bottomLeftCorner(n, k).lazyProduct(group->gain);
  }
  for (int a = 0; a < n; ++a) {
    for (int b = 0; b < n; ++b)
      information_(group->shared[static_cast<std::size_t>(a)],
                   group->shared[static_cast<std::size_t>(b)]) += A(k + a, k + b);
  }
  return true;
}

bool Linearization::ComputeCovariance() {
  for (Group& group : groups_) {
    if (ok_ && !group.rows.empty()) ok_ = Eliminate(&group);
  }
  if (!ok_) return false;
  const int n = num_columns(), e = num_estimated_, c = n - e;
  Eigen::MatrixXd inverse, nulls;
  if (!PseudoInverse(information_.topLeftCorner(e, e), &inverse, &nulls)) return false;
  covariance_.setZero(n, n);
  covariance_.topLeftCorner(e, e) = inverse + inverse * overcounted_.topLeftCorner(e, e) * inverse;
  null_space_ = nulls;
  if (c > 0) {
    const CameraSigma& sigma = problem_.camera_sigma();
    Eigen::VectorXd ambient = Eigen::VectorXd::Zero(kCameraSize);
    ambient << sigma.log_focal, sigma.log_aspect, sigma.principal_point_px,
        sigma.principal_point_px, sigma.k1, Eigen::VectorXd::Zero(kCameraSize - 5);
    const Eigen::MatrixXd P = PlusJacobian(JointProblem::kCamera);
    const Eigen::MatrixXd prior =
        P.transpose() * ambient.cwiseAbs2().asDiagonal() * P;  // P selects.
    const Eigen::MatrixXd follow = -inverse * information_.topRightCorner(e, c);
    covariance_.topLeftCorner(e, e) += follow * prior * follow.transpose();
    covariance_.topRightCorner(e, c) = follow * prior;
    covariance_.bottomLeftCorner(c, e) = covariance_.topRightCorner(e, c).transpose();
    covariance_.bottomRightCorner(c, c) = prior;
  }
  return covariance_.allFinite();
}

double Linearization::OwnVariance(int block, int coordinate) const {
  const int group = problem_.blocks()[static_cast<std::size_t>(block)].group,
            own = own_columns_[static_cast<std::size_t>(block)] + coordinate;
  const Group& of = groups_[static_cast<std::size_t>(group)];
  return of.rows.empty() ? 0.0 : of.inverse(own, own);
}

}  // namespace circline
