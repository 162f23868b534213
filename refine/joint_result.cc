#include "circline/refine/joint_result.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>

#include "circline/refine/covariance.h"
#include "circline/refine/focal.h"
#include "circline/refine/graduated.h"
#include "circline/refine/joint_start.h"

namespace circline {
namespace {

constexpr double kRadToDeg = 57.29577951308232;

// Counts and rms of the inliers; features and points that are outliers as a whole are marked in the
// state as left out.
void CountInliers(const JointEvidence& e, JointState* state, PoseHypothesis* h) {
  double squares = 0.0;
  const JointState before = *state;
  ForEachCurve(e, before,
               [&](const PointSet& set, bool is_circle, std::size_t term,
                   const std::vector<double>& distances) {
                 const std::size_t minimum = is_circle ? 5 : 2;
                 std::size_t inliers = 0;
                 double sum = 0.0;
                 for (const double d : distances) {
                   if (!(std::abs(d) <= kInlierSigmas * set.sigma_px)) continue;
                   ++inliers;
                   sum += d * d;
                 }
                 if (inliers < minimum) {
                   (is_circle ? state->circle_left_out : state->line_left_out)[term] = 1;
                   return;
                 }
                 h->num_inliers += static_cast<int>(inliers);
                 squares += sum;
               });
  for (const PointSet& set : e.sets) h->num_observations += static_cast<int>(set.points.size());
  for (std::size_t i = 0; i < e.points.size(); ++i) {
    const PointTerm& t = e.points[i];
    const double* xy = state->At(t.point);
    const double miss = PointMissPx(t.measured, state->rotation, state->facing, xy[0], xy[1]);
    state->point_left_out[i] = miss <= kInlierSigmas * t.measured.sigma_px ? 0 : 1;
    ++h->num_observations;
    if (state->point_left_out[i] != 0) continue;
    ++h->num_inliers;
    squares += miss * miss;
  }
  h->rms_px = h->num_inliers > 0 ? std::sqrt(squares / h->num_inliers) : 0.0;
}

// Origin of the world in units of the plane's distance, camera frame.
Eigen::Vector3d OriginInPlane(const JointEvidence& e, const JointState& state,
                              const CameraPose& seed) {
  if (e.origin >= 0) {
    const double* o = state.At(e.origin);
    return {o[0], o[1], state.facing};
  }
  double o[2] = {0.0, 0.0};
  PlanePoint(state.rotation, state.facing, seed.translation, o);
  return {o[0], o[1], state.facing};
}

// Whether a known radius or length that has not been left out says how large all is.
bool IsMetric(const JointEvidence& e, const JointState& state) {
  return e.scale >= 0 && state.At(e.scale)[0] > 0.0;
}

void FillPose(const JointEvidence& e, const JointState& state, const Eigen::Vector3d& origin,
              PoseHypothesis* h) {
  h->cam_from_world.rotation = state.rotation;
  const Eigen::Vector3d t = state.rotation * origin;
  h->metric = IsMetric(e, state);
  h->origin_observed = e.origin_observed;
  h->cam_from_world.translation =
      h->metric ? Eigen::Vector3d(t / state.At(e.scale)[0]) : t.normalized();
}

// Columns: how the shared unknowns move [delta, delta_t].
Eigen::MatrixXd PoseFromShared(const JointEvidence& e, const JointState& state,
                               const Eigen::Vector3d& origin, const SharedCovariance& shared) {
  Eigen::MatrixXd T = Eigen::MatrixXd::Zero(6, shared.covariance.cols());
  const Eigen::Matrix3d& R = state.rotation;
  const Eigen::Vector3d P = R * origin;
  // d t / d P: a direction's length does not vary.
  Eigen::Matrix3d by_P =
      (Eigen::Matrix3d::Identity() - P * P.transpose() / P.squaredNorm()) / P.norm();
  if (IsMetric(e, state)) {
    const double scale = state.At(e.scale)[0];
    by_P = Eigen::Matrix3d::Identity() / scale;
    T.block<3, 1>(3, shared.offsets[static_cast<std::size_t>(e.scale)]) = -P / (scale * scale);
  }
  T.topLeftCorner<3, 3>() = R;
  T.block<3, 3>(3, 0) = -by_P * R * CrossMatrix(origin);
  // A spin that nothing fixes is one about the origin, wherever that is.
  if (!e.x_is_fixed) T.block<3, 1>(3, 2).setZero();
  if (e.origin >= 0) {
    T.block<3, 2>(3, shared.offsets[static_cast<std::size_t>(e.origin)]) = by_P * R.leftCols<2>();
  }
  return T;
}

// Orthonormal basis of the free directions among [delta, delta_t].
void FillFreeDirections(const Eigen::MatrixXd& T, const Eigen::MatrixXd& null_space,
                        PoseHypothesis* h) {
  if (null_space.cols() == 0) return;
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(T * null_space);
  qr.setThreshold(1e-6);
  const Eigen::MatrixXd Q = Eigen::MatrixXd(qr.householderQ());
  for (Eigen::Index k = 0; k < qr.rank(); ++k) {
    std::array<double, 6> direction;
    Eigen::Map<Vector6d>(direction.data()) = Q.col(k);
    h->free_directions.push_back(direction);
  }
}

void FillFeatures(const JointEvidence& e, const JointState& state, double unit, PoseHypothesis* h) {
  const Eigen::Matrix3d& R = state.rotation;
  for (std::size_t i = 0; i < e.circles.size(); ++i) {
    const CircleTerm& t = e.circles[i];
    if (state.circle_left_out[i] != 0) continue;
    const double* c = state.At(t.center);
    CircleEstimate estimate;
    estimate.id = e.observations.circles[static_cast<std::size_t>(t.observation)].id;
    estimate.normal = -state.facing * R.col(2);
    const Eigen::Vector3d center = R * Eigen::Vector3d(c[0], c[1], state.facing);
    estimate.center = unit * center;
    estimate.radius = unit * std::abs(t.radius < 0 ? c[2] : t.factor * state.At(t.radius)[0]);
    CameraToPixel(e.camera, center, &estimate.center_px);
    h->circles.push_back(estimate);
  }
  const Eigen::Matrix3d rotation_covariance = h->Covariance().topLeftCorner<3, 3>();
  for (const PencilObservation& pencil : e.observations.pencils) {
    PencilEstimate estimate;
    estimate.id = pencil.id;
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    if (pencil.direction != PencilDirection::kFree) {
      estimate.direction = R.col(static_cast<int>(pencil.direction));
      const Eigen::Matrix3d cross = CrossMatrix(estimate.direction);
      covariance = cross * rotation_covariance * cross.transpose();
    } else if (pencil.fit) {
      estimate.direction = pencil.fit->direction;
      covariance = pencil.fit->covariance;
      const auto theta = e.thetas.find(pencil.id);
      if (theta != e.thetas.end()) {
        const double angle = state.At(theta->second)[0];
        estimate.direction = R * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
      }
    } else {
      continue;
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(covariance, Eigen::EigenvaluesOnly);
    estimate.sigma_deg = kRadToDeg * std::sqrt(std::max(0.0, eigen.eigenvalues()[2]));
    h->pencils.push_back(estimate);
  }
}

// How much wider the estimate scatters than least squares on the inliers would: the variance of an
// M-estimate, E[psi^2] / E[psi']^2 over residuals in standard deviations (Huber 1964), where enough
// of them are redundant to measure it, and never less than what every loss is tuned to.
double Inflation(const JointEvidence& e, const JointState& state) {
  constexpr double kTuned = 1.0 / 0.95;
  const bool is_robust = e.options.conic_loss.type != LossType::kTrivial ||
                         e.options.line_loss.type != LossType::kTrivial;
  if (!is_robust) return 1.0;
  double squares = 0.0, slopes = 0.0, inliers = 0.0, points = 0.0, unknowns = 3.0;
  ForEachCurve(
      e, state,
      [&](const PointSet& set, bool is_circle, std::size_t, const std::vector<double>& distances) {
        unknowns += is_circle ? 3.0 : 1.0;
        points += static_cast<double>(distances.size());
        for (const double d : distances) {
          const double r = d / set.sigma_px, r2 = r * r;
          const LossSlopes loss = LossSlopesAt(set.loss, r2);
          squares += loss.first * loss.first * r2;
          slopes += loss.first + 2.0 * r2 * loss.second;
          inliers += std::abs(r) <= kInlierSigmas ? 1.0 : 0.0;
        }
      });
  constexpr double kEnough = 30.0;
  if (!(points > unknowns + kEnough) || !(slopes > 0.0)) return kTuned;
  const double redundancy = points / (points - unknowns);
  return std::max(kTuned, redundancy * squares * inliers / (slopes * slopes));
}

// In words, what a hypothesis leaves out.
void FillNotes(const JointEvidence& e, const JointState& state, std::vector<std::string>* notes) {
  for (std::size_t i = 0; i < e.circles.size(); ++i) {
    if (state.circle_left_out[i] == 0) continue;
    const auto index = static_cast<std::size_t>(e.circles[i].observation);
    notes->push_back("circle '" + e.observations.circles[index].id +
                     "': left out, it cannot be a circle of the plane found");
  }
  for (std::size_t i = 0; i < e.lines.size(); ++i) {
    if (state.line_left_out[i] == 0) continue;
    notes->push_back(e.lines[i].name + ": left out, it contradicts the pose found");
  }
  for (std::size_t i = 0; i < e.points.size(); ++i) {
    if (state.point_left_out[i] == 0) continue;
    notes->push_back(e.points[i].name + ": left out, it contradicts the pose found");
  }
}

// The focal length's own variance, and what it adds to that of the pose: the pose follows it.
void FillFocal(const FocalModel& focal, double log_focal, double inflation, double prior_sigma,
               const Eigen::MatrixXd& T, PoseHypothesis* h, Matrix6d* covariance) {
  const double variance = 1.0 / (focal.information / inflation + 1.0 / (prior_sigma * prior_sigma));
  const Vector6d by_focal = T * focal.by_focal;
  *covariance += variance * by_focal * by_focal.transpose();
  h->focal_scale = std::exp(log_focal);
  h->focal_sigma = h->focal_scale * std::sqrt(variance);
  Eigen::Map<Vector6d>(h->focal_covariance.data()) = h->focal_scale * variance * by_focal;
}

std::string FocalNote(const PoseHypothesis& h, double prior_sigma) {
  // Then the evidence alone tells it no better than three times as badly as the prior does.
  constexpr double kPriorDecides = 0.95;
  const char* remark = "";
  if (!(h.focal_sigma < kPriorDecides * prior_sigma * h.focal_scale)) {
    remark = std::abs(std::log(h.focal_scale)) < prior_sigma
                 ? "; the evidence cannot tell, the prior alone decides"
                 : "; the evidence contradicts the prior but does not fix it";
  }
  char text[160];
  std::snprintf(text, sizeof(text), "focal length: %.4f times the camera's, +- %.4f%s",
                h.focal_scale, h.focal_sigma, remark);
  return text;
}

// Term by term, what it takes to compare the hypothesis with others.
void FillTerms(const JointEvidence& e, const JointState& state, const SharedCovariance& shared,
               Refined* refined) {
  refined->own_log_det = shared.circle_log_det;
  refined->own_log_det.insert(refined->own_log_det.end(), shared.line_log_det.begin(),
                              shared.line_log_det.end());
  refined->left_out = state.circle_left_out;
  refined->left_out.insert(refined->left_out.end(), state.line_left_out.begin(),
                           state.line_left_out.end());
  for (const CircleTerm& t : e.circles) {
    refined->radii.push_back(
        std::abs(t.radius < 0 ? state.At(t.center)[2] : t.factor * state.At(t.radius)[0]));
    refined->radius_blocks.push_back(t.radius == e.scale ? -1 : t.radius);
  }
}

}  // namespace

double LogDet(const Refined& refined, const std::vector<std::uint8_t>& left_out) {
  double log_det = refined.shared_log_det, log_measure = 0.0, first_radius = 0.0;
  // True if a circle before has the same radius by definition.
  const auto is_counted = [&](std::size_t i) {
    for (std::size_t k = 0; k < i; ++k) {
      if (left_out[k] == 0 && refined.radius_blocks[i] >= 0 &&
          refined.radius_blocks[k] == refined.radius_blocks[i]) {
        return true;
      }
    }
    return false;
  };
  for (std::size_t i = 0; i < left_out.size(); ++i) {
    if (left_out[i] != 0) continue;
    log_det += refined.own_log_det[i];
    if (i >= refined.radii.size()) continue;  // A line.
    if (first_radius == 0.0) {
      first_radius = refined.radii[i];
      log_measure -= 4.0 * std::log(first_radius);
    } else {
      log_measure -= 2.0 * std::log(first_radius);
      if (!is_counted(i)) log_measure -= std::log(refined.radii[i]);
    }
  }
  return log_det + 2.0 * log_measure;
}

CameraPose PoseAt(const JointEvidence& e, const JointState& state, const CameraPose& convention) {
  PoseHypothesis h;
  FillPose(e, state, OriginInPlane(e, state, convention), &h);
  return h.cam_from_world;
}

Status FillRefined(const JointEvidence& base, double log_focal, const JointEvidence& e,
                   const CameraPose& convention, JointState state, Refined* refined) {
  PoseHypothesis* h = &refined->hypothesis;
  const double prior_sigma = base.options.focal_sigma;
  const double inflation = Inflation(e, state);
  CountInliers(e, &state, h);

  SharedCovariance shared;
  if (!std::isfinite(h->cost) || !ComputeCovariance(e, state, &shared))
    return Status::Failed("the refined pose leaves some circle or line without inliers");
  const Eigen::Vector3d origin = OriginInPlane(e, state, convention);
  FillPose(e, state, origin, h);
  const Eigen::MatrixXd T = PoseFromShared(e, state, origin, shared);
  Matrix6d covariance = inflation * T * shared.covariance * T.transpose();
  refined->shared_log_det = shared.log_det;
  if (prior_sigma > 0.0) {
    FocalModel focal;
    if (!ComputeFocalModel(base, state, log_focal, 1.0, shared.covariance, &focal)) {
      return Status::Failed("the evidence cannot be evaluated at other focal lengths");
    }
    FillFocal(focal, log_focal, inflation, prior_sigma, T, h, &covariance);
    refined->notes.push_back(FocalNote(*h, prior_sigma));
    refined->shared_log_det += 2.0 * std::log(h->focal_sigma / h->focal_scale);
  }
  Eigen::Map<Matrix6d>(h->covariance.data()) = covariance;
  FillFreeDirections(T, shared.null_space, h);
  h->rank = CovarianceRank(covariance);
  FillFeatures(e, state, h->cam_from_world.translation.norm() / origin.norm(), h);
  FillNotes(e, state, &refined->notes);
  FillTerms(e, state, shared, refined);
  h->log_det = LogDet(*refined, refined->left_out);
  const bool is_finite = covariance.allFinite() && h->cam_from_world.rotation.allFinite() &&
                         h->cam_from_world.translation.allFinite() && std::isfinite(h->log_det);
  return is_finite ? Status::Ok() : Status::Failed("the refinement left the range of numbers");
}

}  // namespace circline
