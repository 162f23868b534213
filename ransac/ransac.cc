#include "circline/ransac/ransac.h"

#include <climits>
#include <cmath>

namespace circline {

Status RansacOptions::Validate() const {
  // Written so that NaN fails too.
  if (!(threshold > 0.0) || !std::isfinite(threshold)) {
    return Status::Invalid("threshold must be positive");
  }
  if (!(confidence > 0.0 && confidence < 1.0)) {
    return Status::Invalid("confidence must be between 0 and 1, both excluded");
  }
  if (min_iterations < 0) return Status::Invalid("min_iterations must not be negative");
  if (max_iterations < 1) return Status::Invalid("max_iterations must be 1 or more");
  if (local_start < 0) return Status::Invalid("local_start must not be negative");
  if (local_samples < 0) return Status::Invalid("local_samples must not be negative");
  if (local_steps < 0) return Status::Invalid("local_steps must not be negative");
  return Status::Ok();
}

Status RobustFitOptions::Validate() const {
  if (!(sigma_px > 0.0) || !std::isfinite(sigma_px)) {
    return Status::Invalid("sigma_px must be positive");
  }
  return ransac.Validate();
}

int RequiredIterations(int num_data, int num_inliers, int num_samples, double confidence) {
  if (num_inliers < num_samples) return INT_MAX;
  double p = 1.0;
  for (int i = 0; i < num_samples; ++i) {
    p *= static_cast<double>(num_inliers - i) / static_cast<double>(num_data - i);
  }
  if (p >= 1.0) return 1;
  const double draws = std::ceil(std::log1p(-confidence) / std::log1p(-p));
  if (!(draws < static_cast<double>(INT_MAX))) return INT_MAX;
  return std::max(1, static_cast<int>(draws));
}

}  // namespace circline
