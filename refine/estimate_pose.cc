#include "circline/refine/estimate_pose.h"

#include <Eigen/LU>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "circline/estimators/closed_form_solvers.h"
#include "circline/refine/seeded_refinement.h"

namespace circline {

const char* ConicDistanceName(ConicDistanceType type) {
  return type == ConicDistanceType::kSampson ? "sampson" : "orthogonal";
}

bool ConicDistanceFromName(const std::string& name, ConicDistanceType* type) {
  for (const auto known : {ConicDistanceType::kSampson, ConicDistanceType::kOrthogonal}) {
    if (name != ConicDistanceName(known)) continue;
    *type = known;
    return true;
  }
  return false;
}

Status EstimationOptions::Validate() const {
  for (const auto& [loss, name] :
       {std::pair(conic_loss, "conic_loss"), std::pair(line_loss, "line_loss")}) {
    if (!(loss.scale_px >= 0.0) || !std::isfinite(loss.scale_px)) {
      return Status::Invalid(std::string(name) + ".scale_px must be positive, or 0 for auto");
    }
  }
  if (!(contour_bias_px >= 0.0) || !std::isfinite(contour_bias_px))
    return Status::Invalid("contour_bias_px must be 0 or more");
  if (!(line_bias_px >= 0.0) || !std::isfinite(line_bias_px))
    return Status::Invalid("line_bias_px must be 0 or more");
  if (!(focal_sigma >= 0.0) || !(focal_sigma <= 0.5))
    return Status::Invalid("focal_sigma must be between 0 and 0.5");
  if (max_iterations < 1) return Status::Invalid("max_iterations must be 1 or more");
  if (!(max_cost_gap > 0.0)) return Status::Invalid("max_cost_gap must be positive");
  if (prior) {
    const Eigen::Matrix3d product = prior->rotation * prior->rotation.transpose();
    constexpr double kTolerance = 1e-6;
    if (!product.isIdentity(kTolerance) || !(prior->rotation.determinant() > 0.0) ||
        !prior->translation.allFinite() || !(prior->translation.norm() > 0.0)) {
      return Status::Invalid("prior must be a rotation and a translation that is not zero");
    }
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
  std::vector<std::shared_ptr<const Solver>> seeders;
  for (const std::shared_ptr<const Solver>& solver : registry->solvers()) {
    if (solver->stage() == SolverStage::kClosedForm) seeders.push_back(solver);
  }
  return RefineSeeds("joint", seeders, observations, options);
}

}  // namespace circline
