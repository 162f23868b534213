#include "circline/estimators/closed_form_solvers.h"

#include <cmath>
#include <memory>

#include "circline/estimators/closed_form_solver.h"

namespace circline {

Status ClosedFormOptions::Validate() const {
  if (!(sigma_px > 0.0) || !std::isfinite(sigma_px))
    return Status::Invalid("sigma_px must be positive");
  return noise_model.Validate();
}

bool WorldRotation(const Observations& observations, const Eigen::Vector3d& normal,
                   const Eigen::Vector3d& plane_ray, double sigma_px, Eigen::Matrix3d* rotation) {
  Inputs inputs;
  GatherFrame(observations, sigma_px, &inputs);
  GatherAxisLines(observations, sigma_px, &inputs);
  return RotationOfPlane(normal, plane_ray, inputs, rotation);
}

void AddClosedFormSolvers(SolverRegistry* registry, const ClosedFormOptions& options) {
  for (const std::vector<Recipe>& recipes : {PencilRecipes(), CircleRecipes()}) {
    for (const Recipe& recipe : recipes) {
      registry->Add(std::make_shared<ClosedFormSolver>(recipe, options));
    }
  }
}

}  // namespace circline
