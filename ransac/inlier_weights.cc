#include "circline/ransac/inlier_weights.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "circline/estimators/noise_model.h"

namespace circline {

double InlierWeights(const std::vector<double>& residuals, double threshold, int num_parameters,
                     double* sigma, std::vector<double>* weights) {
  int inside = 0, beside = 0;
  for (const double r : residuals) {
    const double size = std::abs(r);
    inside += size <= threshold ? 1 : 0;
    beside += size > threshold && size <= 3.0 * threshold ? 1 : 0;
  }
  // Density of the background per unit of the residual, two thresholds to either side. The half
  // keeps a trace of doubt where none was seen.
  const double background = (beside + 0.5) / (4.0 * threshold);
  const double num_inliers = std::max(1.0, inside - 2.0 * threshold * background);
  const double s = *sigma > 0.0 ? *sigma : threshold / kInlierSigmas;
  const double peak = num_inliers * 0.3989422804014327 / s;
  double sum = 0.0, sum_squares = 0.0;
  weights->resize(residuals.size());
  for (std::size_t i = 0; i < residuals.size(); ++i) {
    const double z = residuals[i] / s;
    double w = 0.0;
    if (std::abs(residuals[i]) <= threshold) {
      const double density = peak * std::exp(-0.5 * z * z);
      w = density / (density + background);
      sum += w;
      sum_squares += w * residuals[i] * residuals[i];
    }
    (*weights)[i] = w;
  }
  const double dof = sum - num_parameters;
  if (dof >= 1.0) {
    *sigma = std::min(std::max(std::sqrt(sum_squares / dof), 1e-3 * threshold), threshold / 2.0);
  }
  return sum;
}

double InlierRms(const std::vector<double>& residuals, double threshold) {
  double inside = 0.0, beside = 0.0, squares = 0.0;
  for (const double r : residuals) {
    const double size = std::abs(r);
    inside += size <= threshold ? 1.0 : 0.0;
    squares += size <= threshold ? r * r : 0.0;
    beside += size > 2.0 * threshold && size <= 4.0 * threshold ? 1.0 : 0.0;
  }
  if (!(squares > 0.0)) return 0.0;
  double variance = squares / inside;
  // Per pixel. The half keeps a trace of doubt where none was seen.
  const double clutter = (beside + 0.5) / (4.0 * threshold);
  constexpr int kPasses = 10;
  for (int pass = 0; pass < kPasses; ++pass) {
    const double peak = inside * 0.3989422804014327 / std::sqrt(variance);
    double sum = 0.0;
    squares = 0.0;
    for (const double r : residuals) {
      if (!(std::abs(r) <= 2.0 * threshold)) continue;
      const double density = peak * std::exp(-0.5 * r * r / variance);
      const double w = density / (density + clutter);
      sum += w;
      squares += w * r * r;
    }
    if (!(squares > 0.0)) break;
    constexpr double kConverged = 1e-3;  // Of the variance.
    const double before = variance;
    variance = squares / sum;
    inside = sum;
    if (std::abs(variance - before) < kConverged * before) break;
  }
  return std::sqrt(variance);
}

}  // namespace circline
