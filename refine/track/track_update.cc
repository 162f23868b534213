// The Gaussian about a hypothesis' minimum on a frame: the next frame's prior, and the evidence.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "circline/refine/track/track_frame.h"

namespace circline {
namespace {

using CurveJacobian = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor,
                                    CurveModel::kMaxSize + 6, kCameraSize>;

}  // namespace

// The information of the unknowns, and across to what is considered: columns of those first. Lines'
// own unknowns are eliminated; `log_det` grows by theirs.
class TrackFrame::Information {
 public:
  Information(TrackFrame* frame, TrackFit* fit)
      : H(frame->scratch_.NewMatrix(Size(*frame), Size(*frame))),
        turn(frame->scratch_.NewMatrix(frame->prior_.root.rows(), frame->prior_.root.rows())),
        moved(frame->scratch_.NewVector(turn.rows())),
        frame_(*frame),
        fit_(*fit) {
    const TrackPrior& prior = frame_.prior_;
    const TrackMap& map = frame_.map_;
    const Eigen::Index n = turn.rows(), c = H.rows() - n;
    frame_.columns_.assign(map.blocks().size(), -1);
    Scratch::Matrix J = frame_.scratch_.NewMatrix(n, n + c);
    Scratch::Vector z = frame_.scratch_.NewVector(n);
    frame_.PriorParameters(fit);
    prior.Evaluate(frame_.parameters_.data(), z.data(), nullptr);
    Eigen::Index column = 0, first = 0;
    for (const int b : prior.blocks) {
      const BlockMatrix plus = PlusJacobian(b);
      frame_.columns_[static_cast<std::size_t>(b)] = column;
      J.middleCols(column, plus.cols()).noalias() =
          prior.by_values.middleCols(first, plus.rows()) * plus;
      column += plus.cols();
      first += plus.rows();
    }
    if (c > 0) frame_.columns_[TrackMap::kCamera] = column;
    // The prior's residuals are L^-1 times how far the unknowns are from the mean.
    turn.noalias() = prior.root.triangularView<Eigen::Lower>() * J.leftCols(n);
    moved.noalias() = prior.root.triangularView<Eigen::Lower>() * z;
    // The mean follows what is considered.
    J.rightCols(c) = -prior.follow;
    HalfSolveInPlace(prior.root, J.rightCols(c));
    H.noalias() = J.transpose() * J;
  }

  // False where the term cannot be evaluated.
  bool Add(std::size_t index, const Weighing& weighing) {
    const Scratch::Scope scope(&frame_.scratch_);
    const Term& term = frame_.terms_[index];
    const double* parameters[kMostBlocks];
    double* jacobians[8];
    CurveJacobian ambient[8];
    frame_.Parameters(term, fit_.state.x.data(), fit_.own.data(), parameters);
    const int rows = term.cost->num_residuals();
    Scratch::Vector residuals = frame_.scratch_.NewVector(rows);
    for (std::size_t k = 0; k < term.blocks.size(); ++k) {
      const int b = term.blocks[k];
      jacobians[k] = nullptr;
      if (b >= 0 && frame_.columns_[static_cast<std::size_t>(b)] < 0) continue;
      ambient[k].resize(rows, term.cost->parameter_block_sizes()[k]);
      jacobians[k] = ambient[k].data();
    }
    if (!term.cost->EvaluateWith(weighing, parameters, residuals.data(), jacobians)) return false;
    Scratch::Matrix J = frame_.scratch_.NewMatrix(rows, H.cols());
    J.setZero();
    for (std::size_t k = 0; k < term.blocks.size(); ++k) {
      if (jacobians[k] == nullptr || term.blocks[k] == kOwn) continue;
      const BlockMatrix plus = PlusJacobian(term.blocks[k]);
      J.middleCols(frame_.columns_[static_cast<std::size_t>(term.blocks[k])], plus.cols())
          .noalias() = ambient[k] * plus;
    }
    if (term.own > 0) {
      const auto at = std::find(term.blocks.begin(), term.blocks.end(), kOwn);
      const CurveJacobian& own = ambient[static_cast<std::size_t>(at - term.blocks.begin())];
      BlockMatrix root = own.transpose() * own;
      if (!FactorInPlace(root)) return true;  // Without inliers.
      log_det += LogDetOfRoot(root);
      Scratch::Matrix B = frame_.scratch_.NewMatrix(own.cols(), H.cols());
      B.noalias() = own.transpose() * J;
      HalfSolveInPlace(root, B);
      H.noalias() -= B.transpose() * B;
    }
    H.noalias() += J.transpose() * J;
    return true;
  }

  Scratch::Matrix H;
  Scratch::Matrix turn;   // The unknowns' tangents at the minimum, in those at the mean.
  Scratch::Vector moved;  // How far they are from the mean, in these.
  double log_det = 0.0;

 private:
  static Eigen::Index Size(const TrackFrame& frame) {
    return static_cast<Eigen::Index>(frame.prior_.rows.size() + frame.prior_.considered.size());
  }

  BlockMatrix PlusJacobian(int b) const {
    const Block& block = frame_.map_.block(b);
    return block.PlusJacobian(fit_.state.x.data() + block.offset);
  }

  TrackFrame& frame_;
  const TrackFit& fit_;
};

// The posterior about the minimum, and Laplace's evidence: exp(-cost) over sqrt(det H det P). What
// is considered stays as it was, and adds S C S^T, S = dx / dc = -H_xx^-1 H_xc, C its covariance
// (Schmidt 1966). The unknowns that no term has to do with follow as they are correlated.
bool TrackFrame::Update(const TrackState& before, TrackFit* fit) {
  const Scratch::Scope scope(&scratch_);
  Information information(this, fit);
  // As a covariance of this library is: of the inliers, and no better than the losses are tuned to.
  const bool is_trivial = options_.conic_loss.type == LossType::kTrivial &&
                          options_.line_loss.type == LossType::kTrivial;
  constexpr double kTuned = 0.95;
  const Weighing weighing{true, kInlierSigmas, is_trivial ? 1.0 : kTuned};
  for (std::size_t i = 0; i < terms_.size(); ++i) {
    if (fit->active[i] != 0 && !information.Add(i, weighing)) return false;
  }
  const Eigen::Index n = information.turn.rows(), c = information.H.rows() - n;
  Scratch::Matrix root = scratch_.NewMatrix(n, n), S = scratch_.NewMatrix(n, c),
                  SC = scratch_.NewMatrix(n, c), inverse = scratch_.NewMatrix(n, n),
                  posterior = scratch_.NewMatrix(n + c, n + c),
                  turn = scratch_.NewMatrix(n + c, n + c);
  root = information.H.topLeftCorner(n, n);
  if (!FactorInPlace(root)) return false;
  const double log_det = information.log_det + LogDetOfRoot(root) + LogDetOfRoot(prior_.root);
  S = -information.H.topRightCorner(n, c);
  SolveInPlace(root, S);
  SC.noalias() = S * prior_.considered_covariance;
  inverse.setIdentity();
  SolveInPlace(root, inverse);
  inverse.noalias() += SC * S.transpose();
  posterior << inverse, SC, SC.transpose(), prior_.considered_covariance;
  turn.setIdentity();
  turn.topLeftCorner(n, n) = information.turn;

  rows_ = prior_.rows;
  rows_.insert(rows_.end(), prior_.considered.begin(), prior_.considered.end());
  Eigen::MatrixXd& P = fit->state.covariance;
  P(Indices(rows_), Indices(rows_)) = posterior;
  if (!UpdateOthers(before, posterior, turn, information.moved, fit)) return false;
  Symmetrize(&P);
  fit->state.log_weight = before.log_weight - news_ * (fit->cost + 0.5 * log_det);
  HoldCamera(before, &fit->state);
  return fit->state.x.allFinite() && P.allFinite() && std::isfinite(fit->state.log_weight);
}

// A frame that says little new says little of the camera, which stays the same: its information
// counts to the power of the news, and all else follows the camera as it is correlated with it.
void TrackFrame::HoldCamera(const TrackState& before, TrackState* state) {
  const Block& camera = map_.block(TrackMap::kCamera);
  const Eigen::Index c = camera.tangent_size(), first = map_.tangent(TrackMap::kCamera);
  if (map_.camera_is_considered || c == 0 || !(news_ < 1.0)) return;
  const Scratch::Scope scope(&scratch_);
  Eigen::MatrixXd& P = state->covariance;
  const auto inverse = [&](BlockMatrix root, BlockMatrix* information) {
    information->setIdentity(c, c);
    if (!FactorInPlace(root)) return false;
    SolveInPlace(root, *information);
    return true;
  };
  const BlockMatrix found = P.block(first, first, c, c);
  BlockMatrix old_information, new_information, covariance;
  if (!inverse(before.covariance.block(first, first, c, c), &old_information) ||
      !inverse(found, &new_information)) {
    return;
  }
  old_information *= 1.0 - news_;
  if (!inverse(old_information + news_ * new_information, &covariance)) return;
  BlockVector moved(c);
  camera.manifold->Minus(before.x.data() + camera.offset, state->x.data() + camera.offset,
                         moved.data());
  const BlockVector back = new_information * (covariance * (old_information * moved));
  const BlockMatrix change = new_information * (covariance - found) * new_information;
  Scratch::Matrix across = scratch_.NewMatrix(P.rows(), c), along = scratch_.NewMatrix(P.rows(), c);
  Scratch::Vector step = scratch_.NewVector(P.rows());
  across = P.middleCols(first, c);
  step.noalias() = across * back;
  along.noalias() = across * change;
  P.noalias() += along * across.transpose();
  state->Move(map_, step);
}

// The unknowns that the frame has nothing to do with.
bool TrackFrame::UpdateOthers(const TrackState& before, const Scratch::Matrix& posterior,
                              const Scratch::Matrix& turn, const Scratch::Vector& moved_by,
                              TrackFit* fit) {
  others_.clear();
  for (Eigen::Index r = 0; r < map_.tangent_size(); ++r) {
    if (std::find(rows_.begin(), rows_.end(), r) == rows_.end()) others_.push_back(r);
  }
  const auto m = static_cast<Eigen::Index>(rows_.size()),
             o = static_cast<Eigen::Index>(others_.size());
  if (o == 0) return true;
  // All transposed.
  Scratch::Matrix root = scratch_.NewMatrix(m, m), across = scratch_.NewMatrix(m, o),
                  gain = scratch_.NewMatrix(m, o), moved = scratch_.NewMatrix(m, o),
                  with = scratch_.NewMatrix(m, o), others = scratch_.NewMatrix(o, o);
  const auto mine = Indices(rows_), theirs = Indices(others_);
  root = before.covariance(mine, mine);
  if (!FactorInPlace(root)) return false;
  across = before.covariance(mine, theirs);
  gain = across;
  SolveInPlace(root, gain);
  moved.noalias() = turn.transpose() * gain;
  with.noalias() = posterior * moved;
  others = before.covariance(theirs, theirs);
  others.noalias() -= gain.transpose() * across;
  others.noalias() += with.transpose() * moved;
  Eigen::MatrixXd& P = fit->state.covariance;
  P(theirs, theirs) = others;
  P(mine, theirs) = with;
  P(theirs, mine) = with.transpose();
  Scratch::Vector step = scratch_.NewVector(o), all = scratch_.NewVector(map_.tangent_size());
  step.noalias() = gain.topRows(moved_by.size()).transpose() * moved_by;
  all.setZero();
  all(theirs) = step;
  fit->state.Move(map_, all);
  return true;
}

}  // namespace circline
