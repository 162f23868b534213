// The inverse of the assembled system, and how far each feature contradicts the others.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "circline/refine/joint/linearization.h"

namespace circline {
namespace {

using Sparse = InverseOnPattern::Sparse;

constexpr double kNoInformation = 1e-12;  // Of an eigenvalue, at unit diagonal.

// Of a matrix that has no eigenvalue below 1e-6 but for rounding.
Eigen::MatrixXd InverseOfPositive(const Eigen::MatrixXd& matrix) {
  const Eigen::Index n = matrix.rows();
  const Eigen::LLT<Eigen::MatrixXd> llt(matrix);
  if (llt.info() == Eigen::Success) return llt.solve(Eigen::MatrixXd::Identity(n, n));
  constexpr double kLeast = 1e-6;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(matrix);
  return eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(kLeast).cwiseInverse().asDiagonal() *
         eigen.eigenvectors().transpose();
}

}  // namespace

Sparse Linearization::Information(Eigen::MatrixXd* with_considered) const {
  const int n = num_unknowns_;
  with_considered->setZero(n, static_cast<Eigen::Index>(uses_.size()) - n);
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < core_size_; ++i) {
    for (int j = 0; j < core_size_; ++j) entries.emplace_back(i, j, 0.0);  // All have a place.
  }
  for (const Rows& rows : rows_) {
    const Eigen::MatrixXd H = rows.J.transpose() * rows.J;
    for (Eigen::Index a = 0; a < H.rows(); ++a) {
      const int i = rows.columns[static_cast<std::size_t>(a)];
      for (Eigen::Index b = 0; i < n && b < H.cols(); ++b) {
        const int j = rows.columns[static_cast<std::size_t>(b)];
        if (j < n) {
          entries.emplace_back(i, j, H(a, b));
        } else {
          (*with_considered)(i, j - n) += H(a, b);
        }
      }
    }
  }
  Sparse information(n, n);
  information.setFromTriplets(entries.begin(), entries.end());
  return information;
}

std::vector<int> Linearization::CoreColumns() const {
  std::vector<int> core(static_cast<std::size_t>(core_size_));
  std::iota(core.begin(), core.end(), 0);
  return core;
}

// Directions of the core without information, at unit diagonal, are found by the variance that they
// have where it is given next to none; with some, v v^T is what the inverse has too much.
bool Linearization::Invert(Sparse information) {
  const Eigen::Index n = core_size_;
  // Less of the largest is rounding: of a turn that nothing at all speaks of.
  constexpr double kRounding = 1e-24;
  const Eigen::VectorXd diagonal = information.diagonal().head(n);
  const double least = n > 0 ? kRounding * diagonal.maxCoeff() : 0.0;
  const Eigen::VectorXd scale =
      diagonal.unaryExpr([least](double d) { return d > least ? 1.0 / std::sqrt(d) : 1.0; });
  Sparse raised = information;
  for (Eigen::Index k = 0; k < n; ++k)
    raised.coeffRef(k, k) += kNoInformation / (scale[k] * scale[k]);
  inverse_.emplace(raised);
  null_space_.resize(n, 0);
  if (!inverse_->ok() || n == 0) return inverse_->ok();
  const Eigen::VectorXd unscale = scale.cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
      unscale.asDiagonal() * Covariance(CoreColumns()) * unscale.asDiagonal());
  if (eigen.info() != Eigen::Success || !eigen.eigenvalues().allFinite()) return false;
  const auto nulls = (eigen.eigenvalues().array() >= 0.5 / kNoInformation).count();
  if (nulls == 0) return true;
  const Eigen::MatrixXd directions = eigen.eigenvectors().rightCols(nulls);
  null_space_ = (scale.asDiagonal() * directions).colwise().normalized();
  Eigen::MatrixXd known = Eigen::MatrixXd::Zero(num_unknowns_, nulls);
  known.topRows(n) = unscale.asDiagonal() * directions;
  const Eigen::MatrixXd more = known.topRows(n) * known.topRows(n).transpose();
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) information.coeffRef(i, j) += more(i, j);
  }
  inverse_.emplace(information);
  if (!inverse_->ok()) return false;
  parts_.push_back({inverse_->Times(known), -Eigen::MatrixXd::Identity(nulls, nulls)});
  return true;
}

// X follows what is considered; that itself has its prior.
void Linearization::AddConsidered(const Eigen::MatrixXd& with_considered) {
  const Eigen::Index c = with_considered.cols();
  if (c == 0) return;
  const Eigen::MatrixXd& P = PlusJacobian(options_.considered);
  const Eigen::VectorXd variances = options_.considered_sigmas.cwiseAbs2();
  Part part{Eigen::MatrixXd(num_unknowns_ + c, c), P.transpose() * variances.asDiagonal() * P};
  part.X.topRows(num_unknowns_) = -inverse_->Times(with_considered);
  part.X.bottomRows(c).setIdentity();
  parts_.push_back(std::move(part));
}

// With A the information and F^T F what it holds too much of, the covariance is that without,
// (A - F^T F)^-1 = A^-1 + X S X^T with X = A^-1 F^T, S = (I - F X)^-1 (Woodbury), about an estimate
// that lies X S r from here, r being what F misses by.
void Linearization::AddOvercounted() {
  const auto size = static_cast<Eigen::Index>(overcounted_residuals_.size());
  if (size == 0) return;
  Sparse F(size, num_unknowns_);
  F.setFromTriplets(overcounted_.begin(), overcounted_.end());
  Part part{inverse_->Times(F.transpose()), {}};
  part.S = InverseOfPositive(Eigen::MatrixXd::Identity(size, size) - F * part.X);
  if (options_.at_minimum) {
    const Eigen::VectorXd away =
        part.S * Eigen::Map<const Eigen::VectorXd>(overcounted_residuals_.data(), size);
    part.S += away * away.transpose();
  }
  parts_.push_back(std::move(part));
}

bool Linearization::ComputeCovariance() {
  if (!ok_ || num_unknowns_ == 0) return false;
  Eigen::MatrixXd with_considered;
  Sparse information = Information(&with_considered);
  for (int k = 0; k < num_unknowns_ && options_.floor > 0.0; ++k)
    information.coeffRef(k, k) = information.coeff(k, k) * (1.0 + options_.floor) + options_.floor;
  parts_.clear();
  if (!Invert(information)) return false;
  AddConsidered(with_considered);
  AddOvercounted();
  covariance_ = Covariance(CoreColumns());
  return covariance_.allFinite();
}

Eigen::MatrixXd Linearization::Covariance(const std::vector<int>& columns) const {
  const auto n = static_cast<Eigen::Index>(columns.size());
  Eigen::MatrixXd covariance =
      Eigen::MatrixXd::NullaryExpr(n, n, [&](Eigen::Index i, Eigen::Index j) {
        const int a = columns[static_cast<std::size_t>(i)],
                  b = columns[static_cast<std::size_t>(j)];
        return std::max(a, b) < num_unknowns_ ? (*inverse_)(a, b) : 0.0;
      });
  for (const Part& part : parts_) {
    Eigen::MatrixXd X = Eigen::MatrixXd::Zero(n, part.X.cols());
    for (Eigen::Index i = 0; i < n; ++i) {
      const int a = columns[static_cast<std::size_t>(i)];
      if (a < part.X.rows()) X.row(i) = part.X.row(a);
    }
    covariance += X * part.S * X.transpose();
  }
  return covariance;
}

Eigen::MatrixXd Linearization::Covariance(const std::vector<Slope>& slopes) const {
  std::vector<int> columns;
  Eigen::MatrixXd J(slopes.front().by_values.rows(), 0);
  for (const Slope& slope : slopes) {
    const std::vector<int> own = Columns(slope.block);
    if (own.empty()) continue;
    const Block& block = graph_.block(slope.block);
    columns.insert(columns.end(), own.begin(), own.end());
    J.conservativeResize(Eigen::NoChange, static_cast<Eigen::Index>(columns.size()));
    J.rightCols(static_cast<Eigen::Index>(own.size())) =
        slope.by_values * block.PlusJacobian(x_ + block.offset);
  }
  return J * Covariance(columns) * J.transpose();
}

// With the leverage S = J Sigma J^T of the feature's residuals f, the others would cost 1/2 f^T S
// (I - S)^-1 f less without it. Where S is 1 the feature alone fixes an unknown: no test there.
Linearization::Misfit Linearization::MisfitOf(std::size_t feature) const {
  const std::vector<Feature>& features = *features_;
  Misfit misfit{-features[feature].free_twice_cost, features[feature].dof};
  for (const std::size_t part : rows_of_[feature]) {
    misfit.d2 += rows_[part].f.squaredNorm();
    const auto own = static_cast<std::size_t>(rows_[part].feature);
    if (own == feature) continue;
    misfit.d2 -= features[own].free_twice_cost;
    misfit.dof += features[own].dof;
  }
  misfit.d2 = std::max(0.0, misfit.d2);
  const Rows all = Together(rows_of_[feature]);
  const Eigen::MatrixXd S = all.J * Covariance(all.columns) * all.J.transpose();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(S);
  for (Eigen::Index k = 0; k < S.rows(); ++k) {
    const double s = std::clamp(eigen.eigenvalues()[k], 0.0, 1.0),
                 along = eigen.eigenvectors().col(k).dot(all.f);
    constexpr double kAlone = 1e-6;
    if (1.0 - s > kAlone) misfit.d2 += along * along * s / (1.0 - s);
  }
  return misfit;
}

std::vector<Linearization::Misfit> Linearization::Misfits() const {
  std::vector<Misfit> misfits(rows_of_.size());
  for (std::size_t i = 0; i < misfits.size(); ++i) {
    if (!rows_of_[i].empty()) misfits[i] = MisfitOf(i);
  }
  return misfits;
}

}  // namespace circline
