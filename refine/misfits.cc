// How far each feature contradicts the others, from the joint problem's linearization.
#include <Eigen/Dense>
#include <algorithm>
#include <vector>

#include "circline/refine/linearization.h"

namespace circline {

// S = J Sigma J^T of all residuals of a feature and of those that say nothing without it, and the
// residuals; those that depend on nothing are left out.
void Linearization::Leverage(const std::vector<const Rows*>& parts, Known* known,
                             Eigen::MatrixXd* S, Eigen::VectorXd* f) const {
  const Group none;
  const Group* group = &none;
  for (const Rows* part : parts) {
    if (part->group >= 0) group = &groups_[static_cast<std::size_t>(part->group)];
  }
  std::vector<int> shared = group->shared;
  Eigen::Index num_rows = 0;
  for (const Rows* part : parts) {
    num_rows += part->J.rows();
    for (const int column : part->columns) {
      if (column >= 0 && std::find(shared.begin(), shared.end(), column) == shared.end())
        shared.push_back(column);
    }
  }
  // By own unknowns, and by shared ones that the own ones follow.
  Eigen::MatrixXd own = Eigen::MatrixXd::Zero(num_rows, group->size);
  Eigen::MatrixXd by_shared =
      Eigen::MatrixXd::Zero(num_rows, static_cast<Eigen::Index>(shared.size()));
  f->resize(num_rows);
  Eigen::Index used = 0;
  for (const Rows* part : parts) {
    for (Eigen::Index r = 0; r < part->J.rows(); ++r) {
      if (part->J.row(r).isZero(0.0)) continue;
      (*f)[used] = part->f[r];
      for (std::size_t c = 0; c < part->columns.size(); ++c) {
        const int column = part->columns[c];
        const double value = part->J(r, static_cast<Eigen::Index>(c));
        if (column < 0) {
          own(used, -1 - column) = value;
        } else {
          by_shared(used, IndexIn(shared, column)) = value;
        }
      }
      ++used;
    }
  }
  f->conservativeResize(used);
  const auto W = own.topRows(used);
  auto B = by_shared.topRows(used);
  const bool has_own = group->size > 0;
  if (has_own) B.leftCols(group->gain.cols()) -= W.lazyProduct(group->gain);
  if (known->columns != shared) *known = {shared, Covariance(shared)};
  const Eigen::MatrixXd follow = B.lazyProduct(known->covariance);
  *S = follow.lazyProduct(B.transpose());
  if (!has_own) return;
  const Eigen::MatrixXd with = W.lazyProduct(group->inverse);
  *S += with.lazyProduct(W.transpose());
}

// With the leverage S = J Sigma J^T of the feature's residuals f, the others would cost 1/2 f^T S
// (I - S)^-1 f less without it. Where S is 1 the feature alone fixes an unknown: no test there.
std::vector<Linearization::Misfit> Linearization::Misfits() const {
  const std::vector<Feature>& features = problem_.features();
  std::vector<Misfit> misfits(features.size());
  std::vector<std::vector<const Rows*>> parts(features.size());
  for (const Rows& rows : rows_) {
    if (rows.feature < 0) continue;
    parts[static_cast<std::size_t>(rows.feature)].push_back(&rows);
    const int parent = features[static_cast<std::size_t>(rows.feature)].parent;
    if (parent >= 0) parts[static_cast<std::size_t>(parent)].push_back(&rows);
  }
  Known known;
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (state_.active[i] != 0 && !parts[i].empty()) misfits[i] = MisfitOf(i, parts[i], &known);
  }
  return misfits;
}

Linearization::Misfit Linearization::MisfitOf(std::size_t feature,
                                              const std::vector<const Rows*>& parts,
                                              Known* known) const {
  const std::vector<Feature>& features = problem_.features();
  Misfit misfit{-features[feature].free_twice_cost, features[feature].dof};
  for (const Rows* part : parts) {
    misfit.d2 += part->twice_cost;
    const auto own = static_cast<std::size_t>(part->feature);
    if (own == feature) continue;
    misfit.d2 -= features[own].free_twice_cost;
    misfit.dof += features[own].dof;
  }
  misfit.d2 = std::max(0.0, misfit.d2);
  Eigen::MatrixXd S;
  Eigen::VectorXd f;
  Leverage(parts, known, &S, &f);
  if (f.size() == 0) return misfit;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(S);
  for (Eigen::Index k = 0; k < f.size(); ++k) {
    const double s = std::clamp(eigen.eigenvalues()[k], 0.0, 1.0),
                 along = eigen.eigenvectors().col(k).dot(f);
    constexpr double kAlone = 1e-6;
    if (1.0 - s > kAlone) misfit.d2 += along * along * s / (1.0 - s);
  }
  return misfit;
}

}  // namespace circline
