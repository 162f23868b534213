#include "circline/refine/estimate_pose.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <utility>
#include <vector>

#include "circline/estimators/closed_form_solvers.h"
#include "circline/refine/joint/known_pose.h"
#include "circline/refine/joint/readings.h"

namespace circline {
namespace {

constexpr std::array kConicDistanceNames = {"auto", "sampson", "orthogonal"};  // By their type.

bool IsPose(const CameraPose& pose) {
  return IsRotation(pose.rotation) && pose.translation.allFinite() && pose.translation.norm() > 0.0;
}

bool IsUnit(const Eigen::Vector3d& v) {
  constexpr double kTolerance = 1e-6;
  return std::abs(v.norm() - 1.0) < kTolerance;
}

}  // namespace

const char* ConicDistanceName(ConicDistanceType type) {
  return kConicDistanceNames[static_cast<std::size_t>(type)];
}

bool ConicDistanceFromName(const std::string& name, ConicDistanceType* type) {
  const auto found = std::find(kConicDistanceNames.begin(), kConicDistanceNames.end(), name);
  if (found == kConicDistanceNames.end()) return false;
  *type = static_cast<ConicDistanceType>(found - kConicDistanceNames.begin());
  return true;
}

Status EstimationOptions::Validate() const {
  for (const auto& [loss, name] :
       {std::pair(conic_loss, "conic_loss"), std::pair(line_loss, "line_loss")}) {
    if (!(loss.scale_px >= 0.0) || !std::isfinite(loss.scale_px)) {
      return Status::Invalid(std::string(name) + ".scale_px must be positive, or 0 for auto");
    }
  }
  Status status = noise_model.Validate();
  if (status.ok() && camera_sigma) status = camera_sigma->Validate();
  if (!status.ok()) return status;
  if (max_iterations < 1) return Status::Invalid("max_iterations must be 1 or more");
  if (!(max_cost_gap > 0.0)) return Status::Invalid("max_cost_gap must be positive");
  if (prior && !IsPose(*prior))
    return Status::Invalid("prior must be a rotation and a translation that is not zero");
  if (pose_prior && (!IsPose(pose_prior->mean) || !IsPositiveDefinite(pose_prior->covariance))) {
    return Status::Invalid(
        "pose_prior must be a rotation, a translation that is not zero and a positive definite "
        "covariance");
  }
  if (gravity_prior && (!IsUnit(gravity_prior->in_world) || !IsUnit(gravity_prior->in_camera) ||
                        !(gravity_prior->sigma_rad > 0.0))) {
    return Status::Invalid("gravity_prior must be two unit vectors and a positive sigma_rad");
  }
  return Status::Ok();
}

PoseEstimate EstimatePose(const Observations& observations, const EstimationOptions& options,
                          const SolverRegistry* registry) {
  SolverRegistry built_in;
  if (registry == nullptr) {
    AddClosedFormSolvers(&built_in);
    registry = &built_in;
  }
  return RefineSeeds("joint", registry->solvers(), observations, options);
}

}  // namespace circline
