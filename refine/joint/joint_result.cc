#include "circline/refine/joint/joint_result.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

#include "circline/estimators/basics.h"
#include "circline/estimators/directions.h"
#include "circline/refine/block_chain.h"
#include "circline/refine/camera_shifts.h"
#include "circline/refine/joint/linearization.h"

namespace circline {
namespace {

// [delta, delta_t] by the core of the shared unknowns: delta in the camera frame.
Eigen::MatrixXd PoseFromCore(const JointProblem& problem, const State& state,
                             const Linearization& at) {
  Eigen::MatrixXd T = Eigen::MatrixXd::Zero(6, at.core_size());
  const std::vector<Block>& blocks = problem.blocks();
  const CameraPose pose = problem.PoseAt(state);
  const int turns = blocks[JointProblem::kRotation].tangent_size();
  T.block(0, at.column(JointProblem::kRotation), 3, turns) = pose.rotation.leftCols(turns);
  const Block& t = blocks[JointProblem::kTranslation];
  if (t.tangent_size() == 0) return T;
  const BlockMatrix J = t.PlusJacobian(state.x.data() + t.offset);
  // A direction has no length.
  const Eigen::Vector3d direction = pose.translation.normalized();
  Eigen::Matrix3d unit = Eigen::Matrix3d::Identity();
  if (!problem.IsMetric(state))
    unit = (unit - direction * direction.transpose()) / pose.translation.norm();
  T.block(3, at.column(JointProblem::kTranslation), 3, t.tangent_size()) = unit * J;
  return T;
}

// Orthonormal basis of the free directions among [delta, delta_t]; a spin about the normal is one
// about the origin, wherever that is.
void FillFreeDirections(const JointProblem& problem, const State& state, const Eigen::MatrixXd& T,
                        const Linearization& at, PoseHypothesis* h) {
  const Eigen::MatrixXd& nulls = at.null_space();
  const bool spin_is_free = problem.SpinIsFree(state);
  Eigen::MatrixXd free(6, nulls.cols() + (spin_is_free ? 1 : 0));
  free.leftCols(nulls.cols()) = T.leftCols(nulls.rows()) * nulls;
  if (spin_is_free) free.rightCols(1) << h->cam_from_world.rotation.col(2), Eigen::Vector3d::Zero();
  if (free.cols() == 0) return;
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(free);
  qr.setThreshold(1e-6);
  const Eigen::MatrixXd Q = Eigen::MatrixXd(qr.householderQ());
  for (Eigen::Index k = 0; k < qr.rank(); ++k) {
    std::array<double, 6> direction;
    Eigen::Map<Vector6d>(direction.data()) = Q.col(k);
    h->free_directions.push_back(direction);
  }
}

void FillCircles(const JointProblem& problem, const State& state, Refined* refined) {
  const CameraPose pose = problem.PoseAt(state);
  // Of the hypothesis, in the state's.
  const double unit = problem.IsMetric(state) ? 1.0 : 1.0 / pose.translation.norm();
  const double* camera = problem.At(JointProblem::kCamera, state);
  const Camera shifted = ShiftedCamera(problem.observations().camera, camera);
  const auto at = [&](int block) { return problem.At(block, state); };
  for (const JointProblem::CircleBlocks& c : problem.circles()) {
    if (!state.Has(c.feature)) continue;
    CircleEstimate estimate;
    estimate.id = problem.ObservationOf(c).id;
    const double* tilt = c.tilt >= 0 ? at(c.tilt) : nullptr;
    PlaceEstimate({at(c.center), at(c.radius)[0], tilt}, pose, unit, shifted, &estimate);
    refined->hypothesis.circles.push_back(estimate);
  }
}

// Standard deviation, degrees, of a pencil's direction whose block is this.
double DirectionSigmaDeg(const JointProblem& problem, const State& state, const Linearization& at,
                         const Eigen::Vector3d& direction, int block) {
  const Eigen::Matrix3d R = problem.PoseAt(state).rotation;
  const double* q = problem.At(JointProblem::kRotation, state);
  std::vector<Linearization::Slope> slopes = {
      {JointProblem::kRotation, -CrossMatrix(direction) * R * DeltaFromQuaternion(q)}};
  if (block >= 0) slopes.push_back({block, R});
  return LargestSigmaDeg(at.Covariance(slopes));
}

// Each pencil's own direction, which leans from its axis as far as the evidence says.
void FillPencils(const JointProblem& problem, const State& state, const Linearization& at,
                 PoseHypothesis* h) {
  const Eigen::Matrix3d R = problem.PoseAt(state).rotation;
  for (std::size_t i = 0; i < problem.observations().pencils.size(); ++i) {
    const PencilObservation& pencil = problem.observations().pencils[i];
    const int block = problem.directions()[i];
    PencilEstimate estimate;
    estimate.id = pencil.id;
    if (block >= 0) {
      estimate.direction = R * Eigen::Vector3d(problem.At(block, state)).normalized();
    } else if (pencil.direction != PencilDirection::kFree) {
      estimate.direction = R.col(static_cast<int>(pencil.direction));
    } else if (pencil.fit) {
      estimate.direction = pencil.fit->direction;
    } else {
      continue;
    }
    estimate.sigma_deg = block < 0 && pencil.direction == PencilDirection::kFree
                             ? LargestSigmaDeg(pencil.fit->covariance)
                             : DirectionSigmaDeg(problem, state, at, estimate.direction, block);
    h->pencils.push_back(estimate);
  }
}

// Then the evidence alone tells a parameter no better than three times as badly as its prior does.
constexpr double kPriorDecides = 0.95;

// What of the camera beside the focal length the evidence could have told, and does not.
void NoteWhatStays(const JointProblem& problem, const Linearization& at, Refined* refined) {
  const CameraSigma& sigma = problem.camera_sigma();
  constexpr double kWidePx = 5.0;  // What is known better needs no word.
  const Eigen::MatrixXd covariance =
      at.Covariance({{JointProblem::kCamera, Eigen::MatrixXd::Identity(kCameraSize, kCameraSize)}});
  const auto stays_at = [&](int shift, double prior) {
    return prior > 0.0 && std::sqrt(covariance(shift, shift)) >= kPriorDecides * prior;
  };
  const double middle = sigma.principal_point_px;
  std::string stays;
  if (middle > kWidePx && stays_at(2, middle) && stays_at(3, middle)) stays = "principal point";
  if (stays_at(4, sigma.k1)) stays += stays.empty() ? "k1" : " and k1";
  if (stays.empty()) return;
  refined->notes.push_back("camera: the evidence cannot tell " + stays +
                           ", the prior alone decides");
}

// Where the prior alone decides, that the figure is a placeholder is as likely as it was before:
// the variance is that of both Gaussians, and the pose's follows along the focal length.
void CountPlaceholder(const CameraSigma& sigma, PoseHypothesis* h) {
  const double narrow = h->focal_sigma, wide = h->focal_scale * sigma.doubtful_log_focal;
  const double variance = (1.0 - kDoubtfulShare) * narrow * narrow + kDoubtfulShare * wide * wide;
  const double ratio = variance / (narrow * narrow);
  const Eigen::Map<Vector6d> across(h->focal_covariance.data());
  Eigen::Map<Matrix6d>(h->covariance.data()) +=
      (ratio - 1.0) / (narrow * narrow) * across * across.transpose();
  Eigen::Map<Vector6d>(h->focal_covariance.data()) *= ratio;
  h->focal_sigma = std::sqrt(variance);
}

// What the evidence says of the focal length that was given.
struct FocalVerdict {
  double off = 0.0;            // Logarithm of what was found over what was given.
  bool is_doubted = false;     // It may be a placeholder, and is.
  bool is_told = false;        // By the evidence, and not by the prior.
  bool prior_decides = false;  // Neither told nor contradicted.
  bool is_odd = false;         // Told, and beyond what the prior allows.

  FocalVerdict(const JointProblem& problem, const PoseHypothesis& h)
      : off(std::log(h.focal_scale) - StatedLogFocal(problem.observations())) {
    const CameraSigma& sigma = problem.camera_sigma();
    is_doubted = sigma.doubtful_log_focal > 0.0 && std::abs(off) > kInlierSigmas * sigma.log_focal;
    const double prior = is_doubted ? sigma.doubtful_log_focal : sigma.log_focal;
    is_told = h.focal_sigma < kPriorDecides * prior * h.focal_scale;
    prior_decides = !is_told && std::abs(off) < prior;
    is_odd = is_told && std::abs(off) > kInlierSigmas * prior;
  }
};

void FillFocal(const JointProblem& problem, const State& state, const Linearization& at,
               const Eigen::MatrixXd& T, Refined* refined) {
  if (!problem.camera_is_estimated()) return;
  PoseHypothesis* h = &refined->hypothesis;
  // The manifold leaves out what is held; the focal length comes first.
  const int column = at.column(JointProblem::kCamera);
  const double* shifts = problem.At(JointProblem::kCamera, state);
  h->camera = ShiftedCamera(problem.observations().camera, shifts);
  h->focal_scale = std::exp(shifts[0]);
  h->focal_sigma = h->focal_scale * std::sqrt(std::max(0.0, at.covariance()(column, column)));
  Eigen::Map<Vector6d>(h->focal_covariance.data()) =
      h->focal_scale * T * at.covariance().col(column);
  const CameraSigma& sigma = problem.camera_sigma();
  const FocalVerdict verdict(problem, *h);
  if (sigma.doubtful_log_focal > 0.0 && verdict.prior_decides && !verdict.is_doubted)
    CountPlaceholder(sigma, h);
  NoteWhatStays(problem, at, refined);
}

// In words, what a hypothesis leaves out.
void FillLeftOut(const JointProblem& problem, const State& state, Refined* refined) {
  for (std::size_t i = 0; i < problem.features().size(); ++i) {
    const Feature& f = problem.features()[i];
    const bool parent_is_out = f.parent >= 0 && !state.Has(f.parent);
    if (problem.TakesPart(i, state.active) || parent_is_out) continue;
    refined->hypothesis.left_out.push_back(f.id);
    refined->notes.push_back(f.name + ": left out, it contradicts the pose found");
  }
  std::string& structure = refined->hypothesis.structure;
  structure = problem.observations().frame.plane;
  for (const std::string& id : refined->hypothesis.left_out) structure += " - " + id;
}

// Log determinant of the covariance of rotation and, where it is estimated, focal length; a turn
// that the evidence says nothing of has the variance of the Gaussian that has as much room as it,
// and no other has more: sqrt(2 pi variance) = 2 pi.
double LogDet(const JointProblem& problem, const Linearization& at) {
  constexpr double kFreeTurn = 2.0 * kPi;
  std::vector<int> columns = at.Columns(JointProblem::kRotation);
  if (problem.camera_is_estimated()) columns.push_back(at.column(JointProblem::kCamera));
  Eigen::MatrixXd covariance = at.covariance()(columns, columns);
  const Eigen::MatrixXd nulls = at.null_space()(columns, Eigen::all);
  covariance += kFreeTurn * nulls * nulls.transpose();
  return LogDetOfKnown(covariance, kFreeTurn);
}

}  // namespace

double LogDetOfKnown(const Eigen::MatrixXd& covariance, double most) {
  double log_det = 0.0;
  constexpr double kNone = 1e-20;  // Rounding: nothing is known, or all is a prior's.
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance, Eigen::EigenvaluesOnly);
  for (const double v : eigen.eigenvalues())
    log_det += std::log(v > kNone ? std::min(v, most) : most);
  return log_det;
}

void PlaceEstimate(const PlaneCircle& circle, const CameraPose& pose, double unit,
                   const Camera& camera, CircleEstimate* estimate) {
  const Eigen::Vector3d in_camera = pose.rotation * circle.center + pose.translation;
  estimate->normal = (pose.rotation * circle.normal).normalized();
  if (estimate->normal.dot(in_camera) > 0.0) estimate->normal = -estimate->normal;
  estimate->center = unit * in_camera;
  estimate->radius = unit * std::abs(circle.radius);
  estimate->center_px.setZero();
  CameraToPixel(camera, in_camera, &estimate->center_px);
}

std::string FocalNote(const JointProblem& problem, const PoseHypothesis& h) {
  if (!problem.camera_is_estimated()) return "";
  const FocalVerdict verdict(problem, h);
  const char* remark =
      verdict.prior_decides ? "; the evidence cannot tell, the prior alone decides"
      : !verdict.is_told    ? "; the evidence contradicts the prior but does not fix it"
      : verdict.is_odd      ? "; the camera given, or the evidence, is not what it seems"
      : verdict.is_doubted  ? "; the figure given is a placeholder"
                            : "";
  const double scale = std::exp(verdict.off);
  char text[160];
  std::snprintf(text, sizeof(text), "focal length: %.4f times the camera's, +- %.4f%s", scale,
                scale * h.focal_sigma / h.focal_scale, remark);
  return text;
}

Status FillRefined(const JointProblem& problem, State state, Refined* refined) {
  *refined = Refined();
  PoseHypothesis* h = &refined->hypothesis;
  problem.SeeThrough(state);
  const double inflation = CountInliers(problem, state, h);
  h->cost = problem.Cost(state) + LeftOutCost(problem, state);
  Linearization at(problem, state, Weighing{true, kInlierSigmas, 1.0 / inflation});
  if (!std::isfinite(h->cost) || !at.ComputeCovariance())
    return Status::Failed("the refined pose leaves some circle or line without inliers");
  const CameraPose pose = problem.PoseAt(state);
  h->metric = problem.IsMetric(state);
  h->origin_observed = problem.origin_observed();
  h->cam_from_world.rotation = pose.rotation;
  h->cam_from_world.translation = h->metric ? pose.translation : pose.translation.normalized();
  const Eigen::MatrixXd T = PoseFromCore(problem, state, at);
  const Matrix6d covariance = T * at.covariance() * T.transpose();
  FillFreeDirections(problem, state, T, at, h);
  SetCovariance(covariance, h, h->metric ? 6 : 5);
  FillCircles(problem, state, refined);
  FillPencils(problem, state, at, h);
  FillFocal(problem, state, at, T, refined);
  FillLeftOut(problem, state, refined);
  h->log_det = LogDet(problem, at);
  refined->circle_volumes = CircleVolumes(problem, state, at);
  const bool is_finite = covariance.allFinite() && pose.rotation.allFinite() &&
                         pose.translation.allFinite() && std::isfinite(h->log_det);
  refined->state = std::move(state);
  return is_finite ? Status::Ok() : Status::Failed("the refinement left the range of numbers");
}

}  // namespace circline
