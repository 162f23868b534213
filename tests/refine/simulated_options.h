// Options for simulated evidence, which has the noise of points and nothing else.
#ifndef CIRCLINE_TESTS_REFINE_SIMULATED_OPTIONS_H_
#define CIRCLINE_TESTS_REFINE_SIMULATED_OPTIONS_H_

#include "circline/estimators/noise_model.h"
#include "circline/refine/estimate_pose.h"

namespace circline {

inline EstimationOptions Exact() {
  EstimationOptions options;
  options.noise_model = NoiseModel::Exact();
  return options;
}

// Gaussian noise without outliers: the bound holds for this.
inline EstimationOptions LeastSquares(const NoiseModel& model = NoiseModel::Exact()) {
  EstimationOptions options;
  options.noise_model = model;
  options.conic_loss.type = options.line_loss.type = LossType::kTrivial;
  return options;
}

}  // namespace circline

#endif  // CIRCLINE_TESTS_REFINE_SIMULATED_OPTIONS_H_
