// The front door: from observations to every pose they admit, ranked, with covariances.
#ifndef CIRCLINE_REFINE_ESTIMATE_POSE_H_
#define CIRCLINE_REFINE_ESTIMATE_POSE_H_

#include <optional>
#include <string>

#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/robust_loss.h"
#include "circline/estimators/solver_registry.h"
#include "circline/estimators/status.h"
#include "circline/refine/image_points.h"

namespace circline {

// How one kind of residual is weighed.
struct LossOptions {
  // Tukey's and Geman and McClure's losses judge all points of a feature, whatever a robust fit has
  // marked, and leave out crowds of outliers in one place: take one of them where half of the
  // points may be wrong. The others see the points marked as inliers.
  LossType type = LossType::kCauchy;
  // Standard deviation of a point, pixels of the photo, for features that state no sigma_px of
  // their own. The loss multiplies it by its own tuning constant. 0 = "auto": estimated from the
  // residuals of the direct fits (1.4826 x median absolute residual).
  double scale_px = 0.0;
};

// "sampson", "orthogonal". (Measured: equally accurate where the noise is below a twentieth of the
// ellipse's shorter semi-axis, as on all photographs; at a tenth the exact one's bias of the tilt
// is a quarter.)
const char* ConicDistanceName(ConicDistanceType type);
bool ConicDistanceFromName(const std::string& name, ConicDistanceType* type);

struct EstimationOptions {
  LossOptions conic_loss;  // Contour points of circles.
  LossOptions line_loss;   // Points of lines.
  ConicDistanceType conic_distance = ConicDistanceType::kSampson;
  // Under "auto": the smooth error that all points of one contour or line share, pixels, so that
  // more points do not make it ever more certain. 0.04 px covers the photographs of circles that
  // this was measured on; a board that is not flat, or a rim with thickness, wants more. >= 0.
  double contour_bias_px = 0.04;
  double line_bias_px = 0.1;
  // Standard deviation of the camera's focal lengths, relative (0.03: 3 %), where they are not
  // known well: above 0 one scale on fx and fy is refined too, with the camera's own ones as prior.
  // 0 = fixed.
  double focal_sigma = 0.0;
  int max_iterations = 50;  // Of each refinement; 1 or more.
  // Seeds whose refined cost exceeds the best by more than this are dropped from the answer, in
  // units of cost (1/2 chi^2); their probability is below exp(-max_cost_gap).
  double max_cost_gap = 30.0;
  // A pose near the one to find, in the same world frame: that of the frame before. Where it leads
  // to a pose under which four fifths of the points are inliers, that one is the answer, alone; the
  // closed forms are asked only where it does not. The unit of its translation does not matter.
  std::optional<CameraPose> prior;

  Status Validate() const;
};

// Refines every hypothesis of the closed forms on all evidence. `registry` null means the built-in
// solvers; else its closed forms give the seeds. Never throws, never returns NaN.
PoseEstimate EstimatePose(const Observations& observations, const EstimationOptions& options = {},
                          const SolverRegistry* registry = nullptr);

}  // namespace circline

#endif  // CIRCLINE_REFINE_ESTIMATE_POSE_H_
