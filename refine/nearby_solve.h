// How ceres is asked to solve from starts that are near. Internal: not installed.
#ifndef CIRCLINE_REFINE_NEARBY_SOLVE_H_
#define CIRCLINE_REFINE_NEARBY_SOLVE_H_

#include <ceres/ceres.h>

#include <algorithm>

namespace circline {

// Of cost: half of a thirtieth of a standard deviation, squared.
constexpr double kLittleCost = 5e-4;
// A step that does less is not worth its derivatives.
constexpr double kNothing = 0.1 * kLittleCost;

inline ceres::Problem::Options OwnsNothing() {
  ceres::Problem::Options ownership;
  ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.disable_all_safety_checks = true;
  return ownership;
}

inline ceres::Solver::Options NearbyOptions(int unknowns, int max_iterations, double cost) {
  ceres::Solver::Options options;
  // Beyond so many unknowns most of them are features' own, and the normal equations are sparse.
  constexpr int kDense = 60;
  options.linear_solver_type =
      unknowns <= kDense ? ceres::DENSE_NORMAL_CHOLESKY : ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = max_iterations;
  options.function_tolerance = kNothing / std::max(1.0, cost);
  options.gradient_tolerance = 1e-9;
  options.parameter_tolerance = 1e-10;
  options.initial_trust_region_radius = 1e6;  // Starts are near, and the model is good.
  // What is known too badly to be estimated stays where it is.
  options.max_trust_region_radius = 1e8;
  options.max_consecutive_nonmonotonic_steps = 0;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;  // Same bits out.
  return options;
}

}  // namespace circline

#endif  // CIRCLINE_REFINE_NEARBY_SOLVE_H_
