// Covariance from the assembled system: elimination of all but the core, and the way back; and how
// far each feature contradicts the others.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "circline/refine/linearization.h"

namespace circline {
namespace {

constexpr double kNoInformation = 1e-12;  // Of an eigenvalue, at unit diagonal.

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

// The information of the core, all others unknown; empty where these carry none.
Eigen::MatrixXd Linearization::EliminateOthers() {
  const int core = core_size(), others = static_cast<int>(groups_.size()) - core;
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(core, core),
                  across = Eigen::MatrixXd::Zero(others, core);
  std::vector<Eigen::Triplet<double>> entries;
  for (const std::vector<std::size_t>& parts : together_) {
    const Rows rows = Together(parts);
    const Eigen::MatrixXd H = rows.J.transpose() * rows.J;
    for (Eigen::Index a = 0; a < H.rows(); ++a) {
      const int i = rows.columns[static_cast<std::size_t>(a)];
      for (Eigen::Index b = 0; b < H.cols(); ++b) {
        const int j = rows.columns[static_cast<std::size_t>(b)];
        if (j >= core) {
          if (i >= core) entries.emplace_back(i - core, j - core, H(a, b));
        } else if (i >= core) {
          across(i - core, j) += H(a, b);
        } else {
          information(i, j) += H(a, b);
        }
      }
    }
  }
  diagonal_ = information.diagonal();
  if (others == 0) return information;
  InverseOnPattern::Sparse own(others, others);
  own.setFromTriplets(entries.begin(), entries.end());
  others_.emplace(own);
  if (!others_->ok()) return {};
  gain_ = others_->Times(across);
  information -= across.transpose() * gain_;
  return information;
}

// A^-1 F^T S F A^-1, A^-1 of the core `inverse`, and what it comes to in the others that F has.
// What is left of F where the others follow the core can be little: it is worked out before it is
// squared.
void Linearization::AddOvercounted(const Eigen::MatrixXd& inverse) {
  const int core = core_size(), e = num_estimated_;
  for (const Overcounted& over : overcounted_) {
    std::vector<int> own;  // Of the others.
    std::vector<Eigen::Index> at;
    Eigen::MatrixXd along = Eigen::MatrixXd::Zero(over.F.rows(), core);
    for (Eigen::Index k = 0; k < over.F.cols(); ++k) {
      const int column = over.columns[static_cast<std::size_t>(k)];
      if (column < core) {
        along.col(column) += over.F.col(k);
        continue;
      }
      along -= over.F.col(k) * gain_.row(column - core);
      own.push_back(column - core);
      at.push_back(k);
    }
    const Eigen::MatrixXd G = along.leftCols(e) * inverse;
    covariance_.topLeftCorner(e, e) += G.transpose() * over.S * G;
    const auto n = static_cast<Eigen::Index>(own.size());
    if (n == 0) continue;
    const Eigen::MatrixXd of_own = over.F(Eigen::all, at) * (*others_)(own);
    const Eigen::MatrixXd with_core = of_own.transpose() * over.S * G,
                          more = of_own.transpose() * over.S * of_own;
    for (Eigen::Index i = 0; i < n; ++i) {
      const int row = own[static_cast<std::size_t>(i)];
      with_core_.row(row).head(e) += with_core.row(i);
      for (Eigen::Index j = 0; j <= i; ++j)
        others_->Add(row, own[static_cast<std::size_t>(j)], more(i, j));
    }
  }
}

bool Linearization::ComputeCovariance() {
  if (!ok_) return false;
  const Eigen::MatrixXd information = EliminateOthers();
  const int n = core_size(), e = num_estimated_, c = n - e;
  Eigen::MatrixXd inverse;
  if (information.rows() != n ||
      !PseudoInverse(information.topLeftCorner(e, e), diagonal_.head(e), &inverse, &null_space_))
    return false;
  covariance_.setZero(n, n);
  covariance_.topLeftCorner(e, e) = inverse;
  with_core_.setZero(gain_.rows(), n);
  AddOvercounted(inverse);
  if (c > 0) {
    const CameraSigma& sigma = problem_.camera_sigma();
    Eigen::VectorXd ambient = Eigen::VectorXd::Zero(kCameraSize);
    ambient << sigma.log_focal, sigma.log_aspect, sigma.principal_point_px,
        sigma.principal_point_px, sigma.k1, Eigen::VectorXd::Zero(kCameraSize - 5);
    const Eigen::MatrixXd P = PlusJacobian(JointProblem::kCamera);
    const Eigen::MatrixXd prior =
        P.transpose() * ambient.cwiseAbs2().asDiagonal() * P;  // P selects.
    const Eigen::MatrixXd follow = -inverse * information.topRightCorner(e, c);
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
    } else {
      by_core.row(i) = -gain_.row(column - core);
      with_core.row(i) = with_core_.row(column - core);
    }
  }
  const Eigen::MatrixXd across = with_core * by_core.transpose();
  Eigen::MatrixXd covariance =
      by_core * covariance_ * by_core.transpose() + across + across.transpose();
  for (Eigen::Index i = 0; i < n; ++i) {
    const int a = columns[static_cast<std::size_t>(i)] - core;
    for (Eigen::Index j = 0; a >= 0 && j < n; ++j) {
      const int b = columns[static_cast<std::size_t>(j)] - core;
      if (b >= 0) covariance(i, j) += (*others_)(a, b);
    }
  }
  return covariance;
}

// With the leverage S = J Sigma J^T of the feature's residuals f, the others would cost 1/2 f^T S
// (I - S)^-1 f less without it. Where S is 1 the feature alone fixes an unknown: no test there.
Linearization::Misfit Linearization::MisfitOf(std::size_t feature,
                                              const std::vector<std::size_t>& parts) const {
  const std::vector<Feature>& features = problem_.features();
  Misfit misfit{-features[feature].free_twice_cost, features[feature].dof};
  for (const std::size_t part : parts) {
    misfit.d2 += rows_[part].f.squaredNorm();
    const auto own = static_cast<std::size_t>(rows_[part].feature);
    if (own == feature) continue;
    misfit.d2 -= features[own].free_twice_cost;
    misfit.dof += features[own].dof;
  }
  misfit.d2 = std::max(0.0, misfit.d2);
  const Rows all = Together(parts);
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

// What says nothing without a feature is a part of it.
std::vector<Linearization::Misfit> Linearization::Misfits() const {
  const std::vector<Feature>& features = problem_.features();
  std::vector<Misfit> misfits(features.size());
  std::vector<std::vector<std::size_t>> parts(features.size());
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    if (rows_[i].feature < 0) continue;
    const auto feature = static_cast<std::size_t>(rows_[i].feature);
    parts[feature].push_back(i);
    if (features[feature].parent >= 0)
      parts[static_cast<std::size_t>(features[feature].parent)].push_back(i);
  }
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (state_.active[i] != 0 && !parts[i].empty()) misfits[i] = MisfitOf(i, parts[i]);
  }
  return misfits;
}

}  // namespace circline
