// From a hypothesis that has been moved on to the same after a frame: ceres' minimum of the frame's
// terms and the prior, and the Gaussian about it.
#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "circline/refine/chi_square.h"
#include "circline/refine/nearby_solve.h"
#include "circline/refine/track_frame.h"

namespace circline {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// Residuals A (x - mean) of several blocks.
class LinearCost final : public ceres::CostFunction {
 public:
  LinearCost(Eigen::MatrixXd A, Eigen::VectorXd mean, const std::vector<int>& sizes)
      : A_(std::move(A)), mean_(std::move(mean)) {
    *mutable_parameter_block_sizes() = sizes;
    set_num_residuals(static_cast<int>(A_.rows()));
  }
  bool Evaluate(const double* const* parameters, double* residuals,
                double** jacobians) const override {
    Eigen::Map<Eigen::VectorXd> r(residuals, A_.rows());
    r = -A_ * mean_;
    Eigen::Index first = 0;
    for (std::size_t k = 0; k < parameter_block_sizes().size(); ++k) {
      const int size = parameter_block_sizes()[k];
      r += A_.middleCols(first, size) * Eigen::Map<const Eigen::VectorXd>(parameters[k], size);
      if (jacobians != nullptr && jacobians[k] != nullptr)
        Eigen::Map<RowMajor>(jacobians[k], A_.rows(), size) = A_.middleCols(first, size);
      first += size;
    }
    return true;
  }

 private:
  Eigen::MatrixXd A_;
  Eigen::VectorXd mean_;
};

double LogDet(const Eigen::LLT<Eigen::MatrixXd>& llt) {
  return 2.0 * llt.matrixLLT().diagonal().array().log().sum();
}

}  // namespace

// The Gaussian of the unknowns that a frame's active terms have to do with: z = A (x - mean) is
// standard normal. A = L^-1 M, L L^T their covariance, M their charts at the mean.
struct TrackFrame::Prior {
  Prior(const TrackFrame& frame, const TrackState& state, const std::vector<std::uint8_t>& active);

  std::vector<int> blocks;             // Of the map, those that are not constant.
  std::vector<Eigen::Index> rows;      // In the state's covariance.
  Eigen::MatrixXd charts, covariance;  // M; L L^T.
  Eigen::LLT<Eigen::MatrixXd> llt;
  Eigen::MatrixXd A;
  std::unique_ptr<LinearCost> cost;
  Eigen::VectorXd Ambient(const TrackMap& map, const Eigen::VectorXd& x) const;
};

Eigen::VectorXd TrackFrame::Prior::Ambient(const TrackMap& map, const Eigen::VectorXd& x) const {
  Eigen::VectorXd out(charts.cols());
  Eigen::Index next = 0;
  for (const int b : blocks) {
    out.segment(next, map.block(b).size) = x.segment(map.block(b).offset, map.block(b).size);
    next += map.block(b).size;
  }
  return out;
}

TrackFrame::Prior::Prior(const TrackFrame& frame, const TrackState& state,
                         const std::vector<std::uint8_t>& active) {
  const TrackMap& map = frame.map_;
  std::vector<std::uint8_t> used(map.blocks().size(), 0);
  used[TrackMap::kRotation] = used[TrackMap::kTranslation] = 1;
  for (std::size_t i = 0; i < frame.terms_.size(); ++i) {
    if (active[i] == 0) continue;
    for (const int b : frame.terms_[i].blocks) {
      if (b >= 0) used[static_cast<std::size_t>(b)] = 1;
    }
  }
  int ambient = 0;
  std::vector<int> sizes;
  for (int b = 0; b < map.size(); ++b) {
    if (used[static_cast<std::size_t>(b)] == 0 || map.block(b).tangent_size() == 0) continue;
    blocks.push_back(b);
    sizes.push_back(map.block(b).size);
    ambient += map.block(b).size;
    for (int k = 0; k < map.block(b).tangent_size(); ++k) rows.push_back(map.tangent(b) + k);
  }
  const auto n = static_cast<Eigen::Index>(rows.size());
  charts.setZero(n, ambient);
  Eigen::Index row = 0, column = 0;
  for (const int b : blocks) {
    const Block& block = map.block(b);
    charts.block(row, column, block.tangent_size(), block.size) =
        ChartOf(block, state.x.data() + block.offset);
    row += block.tangent_size();
    column += block.size;
  }
  covariance = state.covariance(rows, rows);
  llt.compute(covariance);
  A = llt.matrixL().solve(charts);
  cost = std::make_unique<LinearCost>(A, Ambient(map, state.x), sizes);
}

// Returns the number of evaluations.
int TrackFrame::Solve(const Prior& prior, int max_evaluations, TrackFit* fit) const {
  ceres::Problem problem(OwnsNothing());
  double* x = fit->state.x.data();
  int unknowns = static_cast<int>(prior.rows.size());
  std::vector<double*> blocks;
  for (const int b : prior.blocks) {
    const Block& block = map_.block(b);
    problem.AddParameterBlock(x + block.offset, block.size,
                              const_cast<ceres::Manifold*>(block.manifold));  // Not owned.
    blocks.push_back(x + block.offset);
  }
  problem.AddResidualBlock(prior.cost.get(), nullptr, blocks);
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    if (fit->active[i] == 0) continue;
    blocks.clear();
    for (const int b : terms_[i].blocks) {
      double* values = b == kOwn ? fit->own.data() + 2 * i : x + map_.block(b).offset;
      blocks.push_back(values);
      if (b == kOwn) {
        problem.AddParameterBlock(values, terms_[i].own);
        unknowns += terms_[i].own;
      } else if (map_.block(b).tangent_size() == 0) {
        problem.AddParameterBlock(values, map_.block(b).size);
        problem.SetParameterBlockConstant(values);
      }
    }
    problem.AddResidualBlock(terms_[i].cost.get(), nullptr, blocks);
  }
  ceres::Solver::Summary summary;
  // Ceres evaluates once before the first iteration.
  ceres::Solve(NearbyOptions(unknowns, std::max(1, max_evaluations - 1), 1.0), &problem, &summary);
  return static_cast<int>(summary.iterations.size());
}

// By how much twice a term's cost exceeds that of its own free fit; infinite where it has none.
double TrackFrame::Excess(const Term& term, const TrackFit& fit) const {
  constexpr int kMaxResiduals = CurveModel::kMaxSize + 6;
  double residuals[kMaxResiduals], twice_cost = 0.0;
  const double* parameters[8];
  Parameters(term, fit.state.x.data(), fit.own.data(), parameters);
  if (!term.cost->Evaluate(parameters, residuals, nullptr))
    return std::numeric_limits<double>::infinity();
  for (int k = 0; k < term.cost->num_residuals(); ++k) twice_cost += residuals[k] * residuals[k];
  return twice_cost - term.free_twice_cost;
}

// Makes the terms inactive that contradict the others most: at a compromise of all, any may seem
// to. True where there were any.
bool TrackFrame::LeaveOutWorst(double gate_probability, TrackFit* fit) const {
  std::vector<std::pair<double, std::size_t>> odd;
  std::ptrdiff_t num_whole = 0;
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    if (terms_[i].parent < 0) ++num_whole;
    if (fit->active[i] == 0) {
      if (terms_[i].parent < 0) num_whole -= 2;  // Less than half of all may be left out.
      continue;
    }
    const double beyond = Excess(terms_[i], *fit) - ChiSquareLimit(terms_[i].dof, gate_probability);
    if (beyond > 0.0) odd.emplace_back(beyond, i);
  }
  std::sort(odd.begin(), odd.end(), [](const auto& a, const auto& b) {
    return a.first != b.first ? a.first > b.first : a.second < b.second;
  });
  bool any = false;
  for (const auto& [beyond, i] : odd) {
    constexpr double kComparable = 0.5;  // Of the worst.
    // One of two says nothing of which is wrong: the frame contradicts.
    const bool is_whole = terms_[i].parent < 0;
    if (beyond < kComparable * odd.front().first || (is_whole && num_whole <= 2)) break;
    fit->active[i] = 0;
    num_whole -= is_whole ? 2 : 0;
    any = true;
    for (std::size_t k = 0; k < terms_.size(); ++k) {
      if (terms_[k].parent == static_cast<int>(i)) fit->active[k] = 0;
    }
  }
  return any;
}

// Takes back what agrees with the pose that the others have led to. True where there was any.
bool TrackFrame::TakeBack(double gate_probability, TrackFit* fit) const {
  bool any = false;
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    const Term& term = terms_[i];
    const bool has_parent =
        term.parent < 0 || fit->active[static_cast<std::size_t>(term.parent)] != 0;
    if (fit->active[i] != 0 || !has_parent || !Place(i, fit)) continue;
    if (Excess(term, *fit) > ChiSquareLimit(term.dof, gate_probability)) continue;
    fit->active[i] = 1;
    any = true;
  }
  return any;
}

bool TrackFrame::RefineFrom(const TrackState& before, const TrackerOptions& options,
                            TrackFit* fit) const {
  const double gate = options.gate_probability / static_cast<double>(terms_.size());
  bool has_dropped = false, has_taken_back = false;
  for (int left = options.max_evaluations;;) {
    const Prior prior(*this, before, fit->active);
    if (prior.llt.info() != Eigen::Success) return false;
    left -= Solve(prior, left, fit);
    if (!fit->state.x.allFinite()) return false;
    constexpr int kFew = 2;  // Evaluations that come to nothing.
    if (left > kFew && !has_taken_back) {
      if (LeaveOutWorst(gate, fit)) {
        has_dropped = true;
        continue;
      }
      has_taken_back = has_dropped && TakeBack(gate, fit);
      if (has_taken_back) continue;
    }
    return Score(before, prior, gate, fit) && Update(before, prior, fit);
  }
}

// What is left out costs what clutter would: as much as what just agrees.
bool TrackFrame::Score(const TrackState& before, const Prior& prior, double gate_probability,
                       TrackFit* fit) const {
  double left_out = 0.0, free = 0.0;
  fit->dof = 0;
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    const Term& term = terms_[i];
    if (fit->active[i] != 0) {
      fit->dof += term.dof;
      free += term.free_twice_cost;
    } else {
      left_out += 0.5 * (term.free_twice_cost + ChiSquareLimit(term.dof, gate_probability));
    }
  }
  const Eigen::VectorXd moved =
      prior.A * (prior.Ambient(map_, fit->state.x) - prior.Ambient(map_, before.x));
  const double cost = TermsCost(*fit) + 0.5 * moved.squaredNorm();
  fit->misfit = 2.0 * cost - free;
  fit->cost = cost + left_out;
  return std::isfinite(fit->cost);
}

// The posterior about the minimum, H^-1 with H = J^T J of all, and Laplace's evidence: exp(-cost)
// over sqrt(det H det P). The unknowns that no term has to do with follow as they are correlated.
bool TrackFrame::Update(const TrackState& before, const Prior& prior, TrackFit* fit) const {
  const auto n = static_cast<Eigen::Index>(prior.rows.size());
  Eigen::MatrixXd plus = Eigen::MatrixXd::Zero(prior.charts.cols(), n);
  std::vector<Eigen::Index> row_of(map_.blocks().size(), -1), column_of(map_.blocks().size(), -1);
  Eigen::Index row = 0, column = 0;
  for (const int b : prior.blocks) {
    const Block& block = map_.block(b);
    plus.block(column, row, block.size, block.tangent_size()) =
        PlusJacobianOf(block, fit->state.x.data() + block.offset);
    row_of[static_cast<std::size_t>(b)] = row;
    column_of[static_cast<std::size_t>(b)] = column;
    row += block.tangent_size();
    column += block.size;
  }
  const Eigen::MatrixXd turn = prior.charts * plus, whitened = prior.A * plus;
  Eigen::MatrixXd H = whitened.transpose() * whitened;
  double log_det = 0.0;
  // As a covariance of this library is: of the inliers, and no better than the losses are tuned to.
  const bool is_trivial = options_.conic_loss.type == LossType::kTrivial &&
                          options_.line_loss.type == LossType::kTrivial;
  const Weighing weighing{true, kInlierSigmas, is_trivial ? 1.0 : 0.95};
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    const Term& term = terms_[i];
    if (fit->active[i] == 0) continue;
    const double* parameters[8];
    double* jacobians[8];
    RowMajor ambient[8];
    Parameters(term, fit->state.x.data(), fit->own.data(), parameters);
    const int rows = term.cost->num_residuals();
    Eigen::VectorXd residuals(rows);
    for (std::size_t k = 0; k < term.blocks.size(); ++k) {
      const int b = term.blocks[k];
      jacobians[k] = nullptr;
      if (b >= 0 && row_of[static_cast<std::size_t>(b)] < 0) continue;
      ambient[k].resize(rows, term.cost->parameter_block_sizes()[k]);
      jacobians[k] = ambient[k].data();
    }
    if (!term.cost->EvaluateWith(weighing, parameters, residuals.data(), jacobians)) return false;
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(rows, n), own(rows, term.own);
    for (std::size_t k = 0; k < term.blocks.size(); ++k) {
      if (jacobians[k] == nullptr) continue;
      if (term.blocks[k] == kOwn) {
        own = ambient[k];
        continue;
      }
      const auto b = static_cast<std::size_t>(term.blocks[k]);
      const Block& block = map_.block(term.blocks[k]);
      J.middleCols(row_of[b], block.tangent_size()) =
          ambient[k] * plus.block(column_of[b], row_of[b], block.size, block.tangent_size());
    }
    if (term.own > 0) {
      const Eigen::LLT<Eigen::MatrixXd> llt(own.transpose() * own);
      if (llt.info() != Eigen::Success) continue;  // Without inliers.
      log_det += LogDet(llt);
      const Eigen::MatrixXd B = own.transpose() * J;
      H -= B.transpose() * llt.solve(B);
    }
    H += J.transpose() * J;
  }
  const Eigen::LLT<Eigen::MatrixXd> information(H);
  if (information.info() != Eigen::Success) return false;
  log_det += LogDet(information) + LogDet(prior.llt);
  const Eigen::MatrixXd posterior = information.solve(Eigen::MatrixXd::Identity(n, n));

  std::vector<Eigen::Index> others;
  std::vector<std::uint8_t> is_used(static_cast<std::size_t>(map_.tangent_size()), 0);
  for (const Eigen::Index r : prior.rows) is_used[static_cast<std::size_t>(r)] = 1;
  for (Eigen::Index r = 0; r < map_.tangent_size(); ++r) {
    if (is_used[static_cast<std::size_t>(r)] == 0) others.push_back(r);
  }
  Eigen::MatrixXd& P = fit->state.covariance;
  const Eigen::MatrixXd across = before.covariance(others, prior.rows);
  const Eigen::MatrixXd gain = prior.llt.solve(across.transpose()).transpose();
  const Eigen::MatrixXd moved = gain * turn;
  P(others, others) = before.covariance(others, others) - gain * across.transpose() +
                      moved * posterior * moved.transpose();
  P(others, prior.rows) = moved * posterior;
  P(prior.rows, others) = (moved * posterior).transpose();
  P(prior.rows, prior.rows) = posterior;
  P = 0.5 * (P + P.transpose()).eval();
  const Eigen::VectorXd step =
      gain * (prior.charts * (prior.Ambient(map_, fit->state.x) - prior.Ambient(map_, before.x)));
  for (int b = 0; b < map_.size(); ++b) {
    const Block& block = map_.block(b);
    if (row_of[static_cast<std::size_t>(b)] >= 0 || block.tangent_size() == 0) continue;
    const auto first = std::lower_bound(others.begin(), others.end(), map_.tangent(b));
    const Eigen::VectorXd own = step.segment(first - others.begin(), block.tangent_size());
    double* values = fit->state.x.data() + block.offset;
    if (block.manifold == nullptr) {
      Eigen::Map<Eigen::VectorXd>(values, block.size) += own;
    } else {
      const Eigen::VectorXd at = Eigen::Map<Eigen::VectorXd>(values, block.size);
      block.manifold->Plus(at.data(), own.data(), values);
    }
  }
  fit->state.log_weight = before.log_weight - fit->cost - 0.5 * log_det;
  return fit->state.x.allFinite() && P.allFinite() && std::isfinite(fit->state.log_weight);
}

}  // namespace circline
