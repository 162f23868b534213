#include "circline/refine/joint/linearization.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "circline/refine/block_chain.h"

namespace circline {
namespace {

Linearization::Options OptionsOf(const JointProblem& problem) {
  Linearization::Options options;
  options.core = {JointProblem::kRotation, JointProblem::kTranslation};
  if (problem.camera_is_estimated()) {
    options.core.push_back(JointProblem::kCamera);
  } else {
    const Shifts sigmas = ShiftSigmas(problem.observations().camera, problem.camera_sigma());
    options.considered_sigmas = Eigen::Map<const Eigen::VectorXd>(sigmas.data(), kCameraSize);
    if (options.considered_sigmas.maxCoeff() > 0.0) options.considered = JointProblem::kCamera;
  }
  return options;
}

}  // namespace

Linearization::Linearization(const Graph& graph, const std::vector<const Term*>& terms,
                             const double* x, const Weighing& weighing, Options options)
    : graph_(graph), x_(x), options_(std::move(options)) {
  LayOut(terms);
  for (const Term* term : terms) ok_ = ok_ && AddTerm(*term, weighing);
}

Linearization::Linearization(const JointProblem& problem, const State& state,
                             const Weighing& weighing)
    : Linearization(problem, problem.ActiveTerms(state), state.x.data(), weighing,
                    OptionsOf(problem)) {
  features_ = &problem.features();
  rows_of_.resize(features_->size());
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    for (int f = rows_[i].feature; f >= 0; f = problem.feature(f).parent)
      rows_of_[static_cast<std::size_t>(f)].push_back(i);
  }
}

void Linearization::LayOut(const std::vector<const Term*>& terms) {
  columns_.assign(graph_.blocks().size(), -1);
  plus_.resize(graph_.blocks().size());
  const auto add = [&](int block, int size) {
    if (size == 0 || column(block) >= 0) return;
    columns_[static_cast<std::size_t>(block)] = static_cast<int>(uses_.size());
    uses_.resize(uses_.size() + static_cast<std::size_t>(size), 0);
  };
  for (const int block : options_.core) add(block, graph_.block(block).tangent_size());
  core_size_ = static_cast<int>(uses_.size());
  for (const Term* term : terms) {
    for (const int block : term->blocks) add(block, graph_.block(block).tangent_size());
  }
  num_unknowns_ = static_cast<int>(uses_.size());
  if (options_.considered >= 0)
    add(options_.considered, static_cast<int>(PlusJacobian(options_.considered).cols()));
}

std::vector<int> Linearization::Columns(int block) const {
  if (column(block) < 0) return {};
  std::vector<int> columns(static_cast<std::size_t>(graph_.block(block).tangent_size()));
  std::iota(columns.begin(), columns.end(), column(block));
  return columns;
}

const Eigen::MatrixXd& Linearization::PlusJacobian(int index) {
  Eigen::MatrixXd& plus = plus_[static_cast<std::size_t>(index)];
  const Block& block = graph_.block(index);
  if (plus.size() == 0) plus = block.PlusJacobian(x_ + block.offset);
  return plus;
}

bool Linearization::AddTerm(const Term& term, const Weighing& weighing) {
  const double* parameters[kMostBlocks];
  double* jacobians[kMostBlocks];
  graph_.Parameters(term, x_, parameters);
  const int num_rows = term.cost->num_residuals();
  Rows rows{term.feature, {}, {}, Eigen::VectorXd(num_rows)};
  constexpr std::size_t kMostColumns = 20;  // Of nearly all.
  rows.columns.reserve(kMostColumns);
  std::size_t ambient_size = 0;
  for (const int index : term.blocks)
    ambient_size += static_cast<std::size_t>(graph_.block(index).size);
  ambient_.resize(ambient_size * static_cast<std::size_t>(num_rows));
  double* next = ambient_.data();
  for (std::size_t k = 0; k < term.blocks.size(); ++k) {
    const int block = term.blocks[k];
    jacobians[k] = nullptr;
    if (column(block) < 0) continue;
    jacobians[k] = next;
    next += num_rows * graph_.block(block).size;
    const auto size = static_cast<int>(PlusJacobian(block).cols());
    for (int c = column(block); c < column(block) + size; ++c) {
      rows.columns.push_back(c);
      ++uses_[static_cast<std::size_t>(c)];
    }
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
  if (term.loss != nullptr && weighing.inliers_only) CountLoss(term, rows.f.squaredNorm(), &rows);
  rows_.push_back(std::move(rows));
  return true;
}

// The loss counts its residuals W times as much as the covariance does that they are to be counted
// with, 1 or that of leaning walls.
void Linearization::CountLoss(const Term& term, double twice_cost, Rows* rows) {
  if (term.is_counted_at_once) return;
  double rho[3];
  term.loss->Evaluate(twice_cost, rho);
  const double W = std::max(1.0, rho[1]);
  if (term.is_mostly_exact) {
    Eigen::MatrixXd F = rows->J;
    Eigen::VectorXd r = rows->f;
    double information = 1.0;
    Eigen::MatrixXd asked = Eigen::MatrixXd::Identity(F.rows(), F.rows());
    if (term.lean_shape) {
      // In the direction's tangent plane. J^T J is P^T P, the plus Jacobian's, a multiple of 1,
      // over the variance of a direction's two components.
      const Eigen::MatrixXd turned =
          RotationFromBlock(x_ + graph_.block(options_.core.front()).offset) *
          PlusJacobian(term.blocks.front());
      const Eigen::Index n = turned.cols();
      F = Eigen::MatrixXd::Identity(n, n);
      information = rows->J.squaredNorm() / static_cast<double>(n);
      asked = turned.squaredNorm() / static_cast<double>(n) *
              (turned.transpose() * *term.lean_shape * turned).inverse();
      r = rows->J.completeOrthogonalDecomposition().solve(rows->f);
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> too_much(
        information * (W * Eigen::MatrixXd::Identity(asked.rows(), asked.rows()) - asked));
    const Eigen::MatrixXd root = too_much.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal() *
                                 too_much.eigenvectors().transpose();
    F = root * F;
    r = root * r;
    const auto first = static_cast<int>(overcounted_residuals_.size());
    for (int c = 0; c < F.cols(); ++c) {
      for (int k = 0; k < F.rows(); ++k)
        overcounted_.emplace_back(first + k, rows->columns[static_cast<std::size_t>(c)], F(k, c));
    }
    overcounted_residuals_.insert(overcounted_residuals_.end(), r.begin(), r.end());
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

double Linearization::OwnVariance(int feature, int block, int coordinate) const {
  const std::vector<std::size_t>& parts = rows_of_[static_cast<std::size_t>(feature)];
  const Rows all = Together(parts);
  std::vector<Eigen::Index> own;
  Eigen::Index at = -1;
  for (std::size_t c = 0; c < all.columns.size(); ++c) {
    const int column = all.columns[c];
    const auto uses = std::count_if(parts.begin(), parts.end(), [&](std::size_t part) {
      const std::vector<int>& columns = rows_[part].columns;
      return std::find(columns.begin(), columns.end(), column) != columns.end();
    });
    if (column < core_size_ || uses < uses_[static_cast<std::size_t>(column)]) continue;
    if (column == this->column(block) + coordinate) at = static_cast<Eigen::Index>(own.size());
    own.push_back(static_cast<Eigen::Index>(c));
  }
  if (at < 0) return 0.0;
  const Eigen::MatrixXd J = all.J(Eigen::all, own);
  return (J.transpose() * J).inverse()(at, at);
}

}  // namespace circline
