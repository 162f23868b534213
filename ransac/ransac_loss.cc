#include "circline/ransac/ransac_loss.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "circline/estimators/noise_model.h"

namespace circline {
namespace {

constexpr int kTableSize = 256;

// Exponential integral E1 (Abramowitz and Stegun 5.1.11); the series serves 0 < t <= 5.
double ExponentialIntegral(double t) {
  constexpr double kEulerGamma = 0.57721566490153286;
  double sum = -kEulerGamma - std::log(t);
  double term = 1.0;
  for (int k = 1; k <= 60; ++k) {
    term *= -t / k;
    sum -= term / k;
  }
  return sum;
}

// MAGSAC++ for residuals of one degree of freedom, noise levels uniform on (0, T / kInlierSigmas].
// With t = r^2 / (2 sigma_max^2) the weight is
// proportional to E1(t) - E1(t_max) (equation 4 of the paper with n = 1), the loss to its integral.
struct MarginalTables {
  std::array<float, kTableSize + 1> loss, weight;

  MarginalTables() {
    const double t_max = kInlierSigmas * kInlierSigmas / 2.0;
    const double at_max = ExponentialIntegral(t_max);
    const double total = t_max * at_max + 1.0 - std::exp(-t_max) - t_max * at_max;
    // The weight has a (logarithmic) pole at 0: it is capped at half a step of the table.
    const double cap = ExponentialIntegral(0.5 * t_max / kTableSize) - at_max;
    loss[0] = 0.0f;
    weight[0] = 1.0f;
    for (int i = 1; i <= kTableSize; ++i) {
      const double t = t_max * i / kTableSize;
      const double e1 = ExponentialIntegral(t);
      const std::size_t k = static_cast<std::size_t>(i);
      loss[k] = static_cast<float>((t * e1 + 1.0 - std::exp(-t) - t * at_max) / total);
      weight[k] = static_cast<float>((e1 - at_max) / cap);
    }
  }
};

const MarginalTables& Tables() {
  static const MarginalTables tables;  // Immutable.
  return tables;
}

float Interpolate(const std::array<float, kTableSize + 1>& table, float u) {
  const float position = u * static_cast<float>(kTableSize);
  const int i = static_cast<int>(position);
  const std::size_t k = static_cast<std::size_t>(i);
  return table[k] + (table[k + 1] - table[k]) * (position - static_cast<float>(i));
}

}  // namespace

RansacLoss::RansacLoss(ScoreType type) : type_(type) {
  if (type_ == ScoreType::kMagsac) Tables();
}

float RansacLoss::MarginalValue(float u) { return Interpolate(Tables().loss, u); }

float RansacLoss::MarginalWeight(float u) { return Interpolate(Tables().weight, u); }

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
