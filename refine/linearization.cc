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
  gradient_.setZero(next);
  for (Group& group : groups_) {
    group.information.setZero(group.size, group.size);
    group.gradient.setZero(group.size);
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
  std::array<RowMajor, kMaxBlocks> ambient;
  problem_.Parameters(term, state_, parameters);
  Rows rows{term.feature, term.group, {}, {}, Eigen::VectorXd(term.cost->num_residuals()), 0.0};
  Eigen::Index num_local = 0;
  for (std::size_t k = 0; k < term.blocks.size(); ++k) {
    const auto block = static_cast<std::size_t>(term.blocks[k]);
    jacobians[k] = nullptr;
    if (columns_[block] < 0 && own_columns_[block] < 0) continue;
    ambient[k].resize(rows.f.size(), problem_.blocks()[block].size);
    jacobians[k] = ambient[k].data();
    num_local += PlusJacobian(term.blocks[k]).cols();
  }
  const bool evaluated =
      term.weighed != nullptr
          ? term.weighed->EvaluateWith(weighing, parameters, rows.f.data(), jacobians)
          : term.cost->Evaluate(parameters, rows.f.data(), jacobians);
  if (!evaluated) return false;
  rows.J.resize(rows.f.size(), num_local);
  Eigen::Index first = 0;
  for (std::size_t k = 0; k < term.blocks.size(); ++k) {
    if (jacobians[k] == nullptr) continue;
    const auto block = static_cast<std::size_t>(term.blocks[k]);
    const Eigen::MatrixXd& plus = PlusJacobian(term.blocks[k]);
    rows.J.middleCols(first, plus.cols()).noalias() = ambient[k] * plus;
    first += plus.cols();
    for (int c = 0; c < plus.cols(); ++c)
      rows.columns.push_back(columns_[block] >= 0 ? columns_[block] + c
                                                  : -1 - (own_columns_[block] + c));
  }
  rows.twice_cost = rows.f.squaredNorm();
  if (term.loss != nullptr && weighing.inliers_only) TakeLoss(term, &rows);
  AddRows(std::move(rows));
  return true;
}

// The loss counts its residuals W times as much as their variance of 1 asks for: the estimate has
// the covariance A^-1 (A + (W^2 - W) J^T J) A^-1, A with W J^T J.
void Linearization::TakeLoss(const Term& term, Rows* rows) {
  double rho[3];
  term.loss->Evaluate(rows->twice_cost, rho);
  const double W = std::max(1.0, rho[1]);
  const std::size_t counted = term.is_mostly_exact ? rows->columns.size() : 0;
  for (std::size_t a = 0; a < counted; ++a) {
    for (std::size_t b = 0; b < counted; ++b) {
      const auto i = static_cast<Eigen::Index>(a), j = static_cast<Eigen::Index>(b);
      overcounted_(rows->columns[a], rows->columns[b]) +=
          (W * W - W) * rows->J.col(i).dot(rows->J.col(j));
    }
  }
  rows->J *= std::sqrt(W);
  rows->f *= std::sqrt(W);
}

void Linearization::AddRows(Rows rows) {
  const Eigen::MatrixXd H = rows.J.transpose() * rows.J;
  const Eigen::VectorXd g = rows.J.transpose() * rows.f;
  std::vector<int> target(rows.columns.size());
  Eigen::MatrixXd* information = &information_;
  Eigen::VectorXd* gradient = &gradient_;
  if (rows.group >= 0) {
    Group& group = groups_[static_cast<std::size_t>(rows.group)];
    group.used = true;
    for (std::size_t k = 0; k < target.size(); ++k) {
      if (rows.columns[k] < 0) {
        target[k] = -1 - rows.columns[k];
        continue;
      }
      const auto found = std::find(group.shared.begin(), group.shared.end(), rows.columns[k]);
      target[k] = group.size + static_cast<int>(found - group.shared.begin());
      if (found == group.shared.end()) group.shared.push_back(rows.columns[k]);
    }
    const Eigen::Index size = group.size + static_cast<Eigen::Index>(group.shared.size());
    const Eigen::Index before = group.gradient.size();
    if (size > before) {
      group.information.conservativeResize(size, size);
      group.information.rightCols(size - before).setZero();
      group.information.bottomRows(size - before).setZero();
      group.gradient.conservativeResize(size);
      group.gradient.tail(size - before).setZero();
    }
    information = &group.information;
    gradient = &group.gradient;
  } else {
    target = rows.columns;
  }
  for (std::size_t a = 0; a < target.size(); ++a) {
    (*gradient)[target[a]] += g[static_cast<Eigen::Index>(a)];
    for (std::size_t b = 0; b < target.size(); ++b)
      (*information)(target[a], target[b]) +=
          H(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b));
  }
  rows_.push_back(std::move(rows));
}

bool Linearization::EliminateGroups() {
  for (Group& group : groups_) {
    if (!group.used) continue;
    const int k = group.size;
    const auto n = static_cast<Eigen::Index>(group.shared.size());
    if (k > 0 && !Invert(group.information.topLeftCorner(k, k), &group.inverse)) return false;
    const Eigen::MatrixXd gain = group.inverse * group.information.topRightCorner(k, n);
    const Eigen::MatrixXd reduced =
        group.information.bottomRightCorner(n, n) - group.information.bottomLeftCorner(n, k) * gain;
    const Eigen::VectorXd g = group.gradient.tail(n) - gain.transpose() * group.gradient.head(k);
    for (Eigen::Index a = 0; a < n; ++a) {
      gradient_[group.shared[static_cast<std::size_t>(a)]] += g[a];
      for (Eigen::Index b = 0; b < n; ++b)
        information_(group.shared[static_cast<std::size_t>(a)],
                     group.shared[static_cast<std::size_t>(b)]) += reduced(a, b);
    }
  }
  return true;
}

bool Linearization::ComputeCovariance() {
  if (!ok_ || !EliminateGroups()) return false;
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

// Of own and shared columns as `rows` has them.
Eigen::MatrixXd Linearization::LocalCovariance(const Rows& rows) const {
  const auto size = static_cast<Eigen::Index>(rows.columns.size());
  Eigen::MatrixXd from_all, own = Eigen::MatrixXd::Zero(size, size);
  from_all.setZero(size, num_columns());
  const Group* group = rows.group >= 0 ? &groups_[static_cast<std::size_t>(rows.group)] : nullptr;
  Eigen::MatrixXd gain;
  if (group != nullptr && group->size > 0)
    gain = group->inverse * group->information.topRightCorner(
                                group->size, static_cast<Eigen::Index>(group->shared.size()));
  for (Eigen::Index a = 0; a < size; ++a) {
    const int column = rows.columns[static_cast<std::size_t>(a)];
    if (column >= 0) {
      from_all(a, column) = 1.0;
      continue;
    }
    for (std::size_t k = 0; k < group->shared.size(); ++k)
      from_all(a, group->shared[k]) -= gain(-1 - column, static_cast<Eigen::Index>(k));
    for (Eigen::Index b = 0; b < size; ++b) {
      const int other = rows.columns[static_cast<std::size_t>(b)];
      if (other < 0) own(a, b) = group->inverse(-1 - column, -1 - other);
    }
  }
  return own + from_all * covariance_ * from_all.transpose();
}

std::vector<const Linearization::Rows*> Linearization::RowsOf(int feature) const {
  std::vector<const Rows*> found;
  for (const Rows& rows : rows_) {
    const bool is_own = rows.feature == feature;
    const bool is_child =
        rows.feature >= 0 &&
        problem_.features()[static_cast<std::size_t>(rows.feature)].parent == feature;
    if (is_own || is_child) found.push_back(&rows);
  }
  return found;
}

// With the leverage S = J Sigma J^T of the feature's residuals f, the others would cost 1/2 f^T S
// (I - S)^-1 f less without it. Where S is 1 the feature alone fixes an unknown: no test there.
std::vector<Linearization::Misfit> Linearization::Misfits() const {
  const std::vector<Feature>& features = problem_.features();
  std::vector<Misfit> misfits(features.size());
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (state_.active[i] == 0) continue;
    const std::vector<const Rows*> parts = RowsOf(static_cast<int>(i));
    if (parts.empty()) continue;
    Rows all = *parts.front();
    double free_cost = features[i].free_twice_cost;
    misfits[i].dof = features[i].dof;
    for (std::size_t k = 1; k < parts.size(); ++k) {
      const Rows& part = *parts[k];
      const Eigen::Index rows = all.J.rows();
      all.twice_cost += part.twice_cost;
      all.J.conservativeResize(rows + part.J.rows(), Eigen::NoChange);
      all.J.bottomRows(part.J.rows()).setZero();
      all.f.conservativeResize(rows + part.J.rows());
      all.f.tail(part.J.rows()) = part.f;
      for (std::size_t c = 0; c < part.columns.size(); ++c) {
        const auto found = std::find(all.columns.begin(), all.columns.end(), part.columns[c]);
        const auto at = static_cast<Eigen::Index>(found - all.columns.begin());
        if (found == all.columns.end()) {
          all.columns.push_back(part.columns[c]);
          all.J.conservativeResize(Eigen::NoChange, at + 1);
          all.J.col(at).setZero();
        }
        all.J.col(at).tail(part.J.rows()) = part.J.col(static_cast<Eigen::Index>(c));
      }
      if (part.feature >= 0 && part.feature != static_cast<int>(i)) {
        free_cost += features[static_cast<std::size_t>(part.feature)].free_twice_cost;
        misfits[i].dof += features[static_cast<std::size_t>(part.feature)].dof;
      }
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(all.J * LocalCovariance(all) *
                                                               all.J.transpose());
    misfits[i].d2 = std::max(0.0, all.twice_cost - free_cost);
    for (Eigen::Index k = 0; k < eigen.eigenvalues().size(); ++k) {
      const double s = std::clamp(eigen.eigenvalues()[k], 0.0, 1.0),
                   along = eigen.eigenvectors().col(k).dot(all.f);
      constexpr double kAlone = 1e-6;
      if (1.0 - s > kAlone) misfits[i].d2 += along * along * s / (1.0 - s);
    }
  }
  return misfits;
}

double Linearization::OwnVariance(int block, int coordinate) const {
  const int group = problem_.blocks()[static_cast<std::size_t>(block)].group,
            own = own_columns_[static_cast<std::size_t>(block)] + coordinate;
  const Group& of = groups_[static_cast<std::size_t>(group)];
  return of.used ? of.inverse(own, own) : 0.0;
}

}  // namespace circline
