// The Gaussian about a hypothesis' minimum on a frame: the next frame's prior, and the evidence.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "circline/refine/track_frame.h"

namespace circline {
namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

double LogDet(const Eigen::LLT<Eigen::MatrixXd>& llt) {
  return 2.0 * llt.matrixLLT().diagonal().array().log().sum();
}

}  // namespace

// The information of the unknowns, and across to what is considered: columns of those first. Lines'
// own unknowns are eliminated; `log_det` grows by theirs.
class TrackFrame::Information {
 public:
  Information(const TrackFrame& frame, const TrackPrior& prior, const TrackFit& fit)
      : frame_(frame),
        fit_(fit),
        columns_(frame.map_.blocks().size(), -1),
        plus_(frame.map_.blocks().size()) {
    const TrackMap& map = frame.map_;
    const auto n = static_cast<Eigen::Index>(prior.rows.size()),
               c = static_cast<Eigen::Index>(prior.considered.size());
    Eigen::MatrixXd plus = Eigen::MatrixXd::Zero(prior.charts.cols(), n);
    Eigen::Index column = 0, ambient = 0;
    const auto add = [&](int b) {
      const Block& block = map.block(b);
      columns_[static_cast<std::size_t>(b)] = column;
      plus_[static_cast<std::size_t>(b)] = PlusJacobianOf(block, fit.state.x.data() + block.offset);
      column += block.tangent_size();
    };
    for (const int b : prior.blocks) {
      const Block& block = map.block(b);
      add(b);
      const Eigen::Index first = columns_[static_cast<std::size_t>(b)];
      plus.block(ambient, first, block.size, block.tangent_size()) =
          plus_[static_cast<std::size_t>(b)];
      ambient += block.size;
    }
    turn = prior.ChartsAt(map, fit.state.x) * plus;
    if (c > 0) add(TrackMap::kCamera);
    // The prior's residual, and how it follows what is considered.
    Eigen::MatrixXd J(n, n + c);
    J.leftCols(n) = prior.llt.matrixL().solve(turn);
    if (c > 0) J.rightCols(c) = -prior.llt.matrixL().solve(prior.follow);
    H = J.transpose() * J;
  }

  // False where the term cannot be evaluated.
  bool Add(std::size_t index, const Weighing& weighing) {
    const Term& term = frame_.terms_[index];
    const double* parameters[8];
    double* jacobians[8];
    RowMajor ambient[8];
    frame_.Parameters(term, fit_.state.x.data(), fit_.own.data(), parameters);
    const int rows = term.cost->num_residuals();
    Eigen::VectorXd residuals(rows);
    for (std::size_t k = 0; k < term.blocks.size(); ++k) {
      const int b = term.blocks[k];
      jacobians[k] = nullptr;
      if (b >= 0 && columns_[static_cast<std::size_t>(b)] < 0) continue;
      ambient[k].resize(rows, term.cost->parameter_block_sizes()[k]);
      jacobians[k] = ambient[k].data();
    }
    if (!term.cost->EvaluateWith(weighing, parameters, residuals.data(), jacobians)) return false;
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(rows, H.cols());
    for (std::size_t k = 0; k < term.blocks.size(); ++k) {
      if (jacobians[k] == nullptr || term.blocks[k] == kOwn) continue;
      const auto b = static_cast<std::size_t>(term.blocks[k]);
      J.middleCols(columns_[b], plus_[b].cols()).noalias() = ambient[k] * plus_[b];
    }
    if (term.own > 0) {
      const auto at = std::find(term.blocks.begin(), term.blocks.end(), kOwn);
      const RowMajor& own = ambient[static_cast<std::size_t>(at - term.blocks.begin())];
      const Eigen::LLT<Eigen::MatrixXd> llt(own.transpose() * own);
      if (llt.info() != Eigen::Success) return true;  // Without inliers.
      log_det += LogDet(llt);
      const Eigen::MatrixXd B = own.transpose() * J;
      H.noalias() -= B.transpose() * llt.solve(B);
    }
    H.noalias() += J.transpose() * J;
    return true;
  }

  Eigen::MatrixXd H;
  Eigen::MatrixXd turn;  // The unknowns' tangents at the minimum, in the prior's charts.
  double log_det = 0.0;

 private:
  const TrackFrame& frame_;
  const TrackFit& fit_;
  std::vector<Eigen::Index> columns_;  // By block; -1: none.
  std::vector<Eigen::MatrixXd> plus_;  // Their manifolds' derivatives.
};

// The posterior about the minimum, and Laplace's evidence: exp(-cost) over sqrt(det H det P). What
// is considered stays as it was, and adds S C S^T, S = dx / dc = -H_xx^-1 H_xc, C its covariance
// (Schmidt 1966). The unknowns that no term has to do with follow as they are correlated.
bool TrackFrame::Update(const TrackState& before, const TrackPrior& prior, TrackFit* fit) const {
  Information information(*this, prior, *fit);
  // As a covariance of this library is: of the inliers, and no better than the losses are tuned to.
  const bool is_trivial = options_.conic_loss.type == LossType::kTrivial &&
                          options_.line_loss.type == LossType::kTrivial;
  constexpr double kTuned = 0.95;
  const Weighing weighing{true, kInlierSigmas, is_trivial ? 1.0 : kTuned};
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    if (fit->active[i] != 0 && !information.Add(i, weighing)) return false;
  }
  const auto n = static_cast<Eigen::Index>(prior.rows.size()),
             c = static_cast<Eigen::Index>(prior.considered.size());
  const Eigen::LLT<Eigen::MatrixXd> llt(information.H.topLeftCorner(n, n));
  if (llt.info() != Eigen::Success) return false;
  const double log_det = information.log_det + LogDet(llt) + LogDet(prior.llt);
  Eigen::MatrixXd S(n, c);
  if (c > 0) S = -llt.solve(information.H.topRightCorner(n, c));
  const Eigen::MatrixXd SC = S * prior.considered_covariance;
  Eigen::MatrixXd posterior(n + c, n + c), turn = Eigen::MatrixXd::Identity(n + c, n + c);
  posterior << llt.solve(Eigen::MatrixXd::Identity(n, n)) + SC * S.transpose(), SC, SC.transpose(),
      prior.considered_covariance;
  turn.topLeftCorner(n, n) = information.turn;

  std::vector<Eigen::Index> rows = prior.rows, others;
  rows.insert(rows.end(), prior.considered.begin(), prior.considered.end());
  std::vector<std::uint8_t> is_used(static_cast<std::size_t>(map_.tangent_size()), 0);
  for (const Eigen::Index r : rows) is_used[static_cast<std::size_t>(r)] = 1;
  for (Eigen::Index r = 0; r < map_.tangent_size(); ++r) {
    if (is_used[static_cast<std::size_t>(r)] == 0) others.push_back(r);
  }
  Eigen::MatrixXd& P = fit->state.covariance;
  P(rows, rows) = posterior;
  if (!others.empty()) {
    const Eigen::LLT<Eigen::MatrixXd> all(before.covariance(rows, rows));
    if (all.info() != Eigen::Success) return false;
    const Eigen::MatrixXd across = before.covariance(rows, others);
    const Eigen::MatrixXd gain = all.solve(across).transpose(), moved = gain * turn;
    const Eigen::MatrixXd with = moved * posterior;
    P(others, others) =
        before.covariance(others, others) - gain * across + with * moved.transpose();
    P(others, rows) = with;
    P(rows, others) = with.transpose();
    MoveOthers(others, gain.leftCols(n) * prior.Moved(map_, fit->state.x), &fit->state);
  }
  P = 0.5 * (P + P.transpose()).eval();
  fit->state.log_weight = before.log_weight - fit->cost - 0.5 * log_det;
  return fit->state.x.allFinite() && P.allFinite() && std::isfinite(fit->state.log_weight);
}

// `step`: of these rows of the covariance, whole blocks.
void TrackFrame::MoveOthers(const std::vector<Eigen::Index>& rows, const Eigen::VectorXd& step,
                            TrackState* state) const {
  for (int b = 0; b < map_.size(); ++b) {
    const Block& block = map_.block(b);
    const auto first = std::lower_bound(rows.begin(), rows.end(), map_.tangent(b));
    if (block.tangent_size() == 0 || first == rows.end() || *first != map_.tangent(b)) continue;
    const Eigen::VectorXd own = step.segment(first - rows.begin(), block.tangent_size());
    double* values = state->x.data() + block.offset;
    if (block.manifold == nullptr) {
      Eigen::Map<Eigen::VectorXd>(values, block.size) += own;
    } else {
      const Eigen::VectorXd at = Eigen::Map<Eigen::VectorXd>(values, block.size);
      block.manifold->Plus(at.data(), own.data(), values);
    }
  }
}

}  // namespace circline
