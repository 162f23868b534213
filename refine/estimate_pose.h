// The front door: from observations to every pose they admit, ranked, with covariances.
#ifndef CIRCLINE_REFINE_ESTIMATE_POSE_H_
#define CIRCLINE_REFINE_ESTIMATE_POSE_H_

#include <array>
#include <optional>
#include <string>

#include "circline/estimators/export.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/robust_loss.h"
#include "circline/estimators/solver_registry.h"
#include "circline/estimators/status.h"
#include "circline/refine/image_points.h"

namespace CIRCLINE_EXPORT circline {

// How one kind of residual is weighed. Points that a robust fit has marked as outliers take no
// part.
struct LossOptions {
  LossType type = LossType::kCauchy;  // kTrivial: least squares.
  // Standard deviation of a point, pixels of the photo, for features that state no sigma_px of
  // their own. The loss multiplies it by its own tuning constant. 0 = "auto": each feature's from
  // the scatter of its points (MeasurePointNoise).
  double scale_px = 0.0;
};

const char* ConicDistanceName(ConicDistanceType type);  // "auto", "sampson", "orthogonal".
// False, with `type` untouched, where there is no such name.
bool ConicDistanceFromName(const std::string& name, ConicDistanceType* type);

// A pose that is known from elsewhere (odometry, the filter's prediction), in the resolved world
// (ResolveWorld): evidence like any other, in the estimate, in its covariance and in the ranking.
// One that contradicts the photo is left out ("pose_prior"), and where nothing else tells the turn
// about the normal that is free. With it one pencil of parallel lines, which alone is refused,
// gives a pose.
struct PosePrior {
  CameraPose mean;  // cam_from_world.
  // Of [delta, delta_t], 6x6 row-major, as PoseHypothesis::covariance; positive definite. Where the
  // scale or the origin of the world are not observed, t has no part in it.
  std::array<double, 36> covariance{};
};

// A direction of the world that is known in the camera: gravity from an accelerometer. Likewise
// evidence ("gravity_prior"); with it one pencil gives the rotation, unless gravity runs along it.
// `in_world` is a direction of the resolved world (ResolveWorld), whose X axis runs, where no role
// and no drawn axis says otherwise, along the first free pencil of the plane. Along the plane's
// normal it is the same whatever X is; for any other give a pencil a role, or draw an axis.
struct GravityPrior {
  Eigen::Vector3d in_world = Eigen::Vector3d::UnitZ();   // Unit.
  Eigen::Vector3d in_camera = Eigen::Vector3d::UnitY();  // Unit.
  double sigma_rad = 0.01;                               // Of each of two components; > 0.
};

// How EstimatePose weighs, and what is known beside the photo.
struct EstimationOptions {
  LossOptions conic_loss;                                       // Contour points of circles.
  LossOptions line_loss;                                        // Points of lines.
  ConicDistanceType conic_distance = ConicDistanceType::kAuto;  // Of contour points.
  // What is not exact beside the points; NoiseModel::Exact() for simulated evidence.
  NoiseModel noise_model;
  // How well the camera is known; none = noise_model.camera. Where log_focal is 0.01 or more the
  // camera is estimated too (focal length and whatever else has a sigma), from several starts where
  // it is 0.1 or more; below, it stays as given and its uncertainty is counted in the pose's. The
  // prior is about Observations::stated_focal_px. Where the posterior has several humps in it each
  // is a hypothesis.
  std::optional<CameraSigma> camera_sigma;
  std::optional<PosePrior> pose_prior;        // The pose, known from elsewhere.
  std::optional<GravityPrior> gravity_prior;  // A direction, known from elsewhere.
  // A pose near the one to find, in the same world frame: that of the frame before. A start and no
  // evidence: where four fifths of the points are inliers under it, circles propose their planes
  // besides, and the other closed forms are not asked. The unit of its translation does not matter.
  std::optional<CameraPose> prior;
  int max_iterations = 50;  // Of each refinement; 1 or more.
  // Hypotheses whose cost exceeds the best by more than this are dropped from the answer, in units
  // of cost (1/2 chi^2); their probability is below exp(-max_cost_gap).
  double max_cost_gap = 30.0;

  // Ok, or a sentence that names the field which is wrong.
  Status Validate() const;
};

// Refines every hypothesis of the closed forms on all evidence, in one ceres::Problem. Features
// that contradict the rest as a whole are left out and named (PoseHypothesis::left_out, `notes`);
// the readings that keep them stay among the hypotheses. Poses less than two standard deviations
// apart are one hypothesis, but for those of a lone circle. `registry` null means the built-in
// solvers; else its closed forms give the seeds. Never throws, never returns NaN. Thread-safe.
PoseEstimate EstimatePose(const Observations& observations, const EstimationOptions& options = {},
                          const SolverRegistry* registry = nullptr);

}  // namespace circline

#endif  // CIRCLINE_REFINE_ESTIMATE_POSE_H_
