// Covariance from the assembled system: elimination of what features have of their own and of the
// leaves, and the way back.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "circline/refine/linearization.h"

namespace circline {
namespace {

constexpr double kNoInformation = 1e-12;  // Of an eigenvalue, at unit diagonal.

// Solves the first k equations of a symmetric system for their own unknowns (Goodnight 1979): A, B
// of [A B; B^T C] become -A^-1 and A^-1 B, and C becomes C - B^T A^-1 B. False where A is not
// positive definite.
bool Sweep(Eigen::Index k, Eigen::MatrixXd* system) {
  Eigen::VectorXd column(system->rows());
  for (Eigen::Index p = 0; p < k; ++p) {
    const double pivot = (*system)(p, p);
    if (!(pivot > 0.0) || !std::isfinite(pivot)) return false;
    column = system->col(p) / pivot;
    for (Eigen::Index j = 0; j < system->cols(); ++j)
      system->col(j) -= (pivot * column[j]) * column;
    system->col(p) = column;
    system->row(p) = column.transpose();
    (*system)(p, p) = -1.0 / pivot;
  }
  return system->allFinite();
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
    for (std::size_t a = 0; a < target.size(); ++a) {
      for (std::size_t b = 0; b <= a; ++b) {
        const auto i = static_cast<Eigen::Index>(a), j = static_cast<Eigen::Index>(b);
        const double sum = rows.J.col(i).dot(rows.J.col(j));
        A(target[a], target[b]) += sum;
        if (a != b) A(target[b], target[a]) += sum;
      }
    }
  }
  if (!Sweep(k, &A)) return false;
  group->inverse = -A.topLeftCorner(k, k);
  group->gain = A.topRightCorner(k, n);
  for (int a = 0; a < n; ++a) {
    for (int b = 0; b < n; ++b)
      Add(group->shared[static_cast<std::size_t>(a)], group->shared[static_cast<std::size_t>(b)],
          A(k + a, k + b));
  }
  return true;
}

// A leaf out of the core's information.
bool Linearization::Eliminate(std::size_t index) {
  Leaf& leaf = leaves_[index];
  const auto& [own, with_core] = information_.leaves[index];
  Eigen::MatrixXd unused;
  if (!PseudoInverse(own, own.diagonal(), &leaf.inverse, &unused)) return false;
  for (int column = 0; column < core_size(); ++column) {
    if (!with_core.col(column).isZero(0.0)) leaf.meets.push_back(column);
  }
  const Eigen::MatrixXd met = with_core(Eigen::all, leaf.meets);
  leaf.gain = leaf.inverse * met;
  information_.core(leaf.meets, leaf.meets) -= met.transpose() * leaf.gain;
  leaf.covariance = leaf.inverse;
  leaf.with_core.setZero(leaf.size, core_size());
  return true;
}

// F where the leaves follow the core, by the core's columns. What is left of it can be little: that
// is why it is worked out before it is squared.
Eigen::MatrixXd Linearization::AlongCore(const Overcounted& over) const {
  const int core = core_size(), e = num_estimated_;
  Eigen::MatrixXd along = Eigen::MatrixXd::Zero(over.F.rows(), e);
  for (Eigen::Index k = 0; k < over.F.cols(); ++k) {
    const int column = over.columns[static_cast<std::size_t>(k)];
    if (column < e) {
      along.col(column) += over.F.col(k);
    } else if (column >= core) {
      const Leaf& leaf = leaves_[LeafAt(column)];
      for (std::size_t i = 0; i < leaf.meets.size(); ++i) {
        const double gain = leaf.gain(column - leaf.first, static_cast<Eigen::Index>(i));
        if (leaf.meets[i] < e) along.col(leaf.meets[i]) -= gain * over.F.col(k);
      }
    }
  }
  return along;
}

// A^-1 F^T S F A^-1, A^-1 of the core `inverse`, and what it comes to in the leaves.
void Linearization::AddOvercounted(const Eigen::MatrixXd& inverse) {
  const int core = core_size(), e = num_estimated_;
  Eigen::Index num_rows = 0;
  for (const Overcounted& over : overcounted_) num_rows += over.F.rows();
  Eigen::MatrixXd G(num_rows, e), SG(num_rows, e);
  Eigen::Index first = 0;
  for (const Overcounted& over : overcounted_) {
    const Eigen::Index rows = over.F.rows();
    G.middleRows(first, rows) = AlongCore(over) * inverse;
    SG.middleRows(first, rows) = over.S * G.middleRows(first, rows);
    const auto own = std::find_if(over.columns.begin(), over.columns.end(),
                                  [&](int column) { return column >= core; });
    if (own != over.columns.end()) {
      Leaf& leaf = leaves_[LeafAt(*own)];
      Eigen::MatrixXd of_leaf = Eigen::MatrixXd::Zero(rows, leaf.size);
      for (std::size_t k = 0; k < over.columns.size(); ++k) {
        if (over.columns[k] >= core)
          of_leaf.col(over.columns[k] - leaf.first) = over.F.col(static_cast<Eigen::Index>(k));
      }
      of_leaf *= leaf.inverse;
      leaf.covariance += of_leaf.transpose() * over.S * of_leaf;
      leaf.with_core.leftCols(e) += of_leaf.transpose() * SG.middleRows(first, rows);
    }
    first += rows;
  }
  covariance_.topLeftCorner(e, e) += G.transpose() * SG;
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
  covariance_.topLeftCorner(e, e) = inverse;
  AddOvercounted(inverse);
  null_space_ = nulls;
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
  std::vector<int> met;  // Of the core's columns, by those of `columns` or their leaves.
  for (const int column : columns) {
    if (column < core) {
      met.push_back(column);
    } else {
      const std::vector<int>& meets = leaves_[LeafAt(column)].meets;
      met.insert(met.end(), meets.begin(), meets.end());
    }
  }
  std::sort(met.begin(), met.end());
  met.erase(std::unique(met.begin(), met.end()), met.end());
  const auto at = [&met](int column) {
    return std::lower_bound(met.begin(), met.end(), column) - met.begin();
  };
  const auto m = static_cast<Eigen::Index>(met.size());
  Eigen::MatrixXd by_core = Eigen::MatrixXd::Zero(n, m), with_core = by_core;
  for (Eigen::Index i = 0; i < n; ++i) {
    const int column = columns[static_cast<std::size_t>(i)];
    if (column < core) {
      by_core(i, at(column)) = 1.0;
      continue;
    }
    const Leaf& leaf = leaves_[LeafAt(column)];
    const int row = column - leaf.first;
    for (std::size_t k = 0; k < leaf.meets.size(); ++k)
      by_core(i, at(leaf.meets[k])) = -leaf.gain(row, static_cast<Eigen::Index>(k));
    for (Eigen::Index k = 0; k < m; ++k)
      with_core(i, k) = leaf.with_core(row, met[static_cast<std::size_t>(k)]);
  }
  const Eigen::MatrixXd across = with_core * by_core.transpose();
  Eigen::MatrixXd covariance =
      by_core * covariance_(met, met) * by_core.transpose() + across + across.transpose();
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
