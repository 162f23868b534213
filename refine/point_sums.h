// Sums of robust costs over points, and their models to second order: the innermost loops of every
// refinement. Internal: not installed.
#ifndef CIRCLINE_REFINE_POINT_SUMS_H_
#define CIRCLINE_REFINE_POINT_SUMS_H_

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "circline/estimators/robust_loss.h"
#include "circline/refine/image_points.h"

namespace circline {

// Where a loss bends back, that much of its slope stands for the curvature, so that the model has a
// minimum. With less, a line's two points on either side of the bend throw it far off (0.1: three
// times the iterations on many short lines); with more, the last steps creep.
inline constexpr double kLeastCurvature = 0.4;
inline constexpr std::size_t kChunk =
    32;  // Points at a time: their rows stay in the fastest memory.

// sum rho over squared residuals s, each one's slope rho' and curvature of rho(r^2)/2, not below
// kLeastCurvature of the slope.
template <LossType kLoss>
double ApplyLoss(std::size_t n, const double* s, double* slope, double* curvature) {
  double sum = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    if constexpr (kLoss == LossType::kCauchy) {
      sum = i == 0 ? 1.0 : sum;  // One logarithm of a product instead of many.
      constexpr double kInverse = 1.0 / (LossTuningConstant(kLoss) * LossTuningConstant(kLoss));
      sum *= 1.0 + std::min(s[i], 1e8) * kInverse;
    } else {
      sum += LossRho(kLoss, s[i]);
    }
    const LossSlopes loss = LossSlopesAt(kLoss, s[i]);
    slope[i] = loss.first;
    curvature[i] = std::max(loss.first + 2.0 * s[i] * loss.second, kLeastCurvature * loss.first);
  }
  if constexpr (kLoss == LossType::kCauchy) {
    constexpr double kC2 = LossTuningConstant(kLoss) * LossTuningConstant(kLoss);
    return n == 0 ? 0.0 : kC2 * std::log(sum);
  }
  return sum;
}

inline double ApplyLoss(LossType type, std::size_t n, const double* s, double* slope,
                        double* curvature) {
  switch (type) {
    case LossType::kTrivial:
      break;
    case LossType::kHuber:
      return ApplyLoss<LossType::kHuber>(n, s, slope, curvature);
    case LossType::kSoftLOne:
      return ApplyLoss<LossType::kSoftLOne>(n, s, slope, curvature);
    case LossType::kCauchy:
      return ApplyLoss<LossType::kCauchy>(n, s, slope, curvature);
    case LossType::kArctan:
      return ApplyLoss<LossType::kArctan>(n, s, slope, curvature);
    case LossType::kTukey:
      return ApplyLoss<LossType::kTukey>(n, s, slope, curvature);
    case LossType::kGemanMcClure:
      return ApplyLoss<LossType::kGemanMcClure>(n, s, slope, curvature);
  }
  return ApplyLoss<LossType::kTrivial>(n, s, slope, curvature);
}

inline double ApplyGate(double gate, std::size_t n, double* s, double* slope, double* curvature) {
  double sum = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const double inlier = s[i] <= gate * gate ? 1.0 : 0.0;
    slope[i] = curvature[i] = inlier;
    sum += inlier * s[i];
  }
  return sum;
}

// Sums over n points; distance(i, row) is the signed distance in pixels of the i-th and, where row
// is not null, writes its derivatives by kSize local variables.
template <int kSize, typename Distance>
double SumPoints(std::size_t n, const ImagePoints::Options& options, const Weighing& weighing,
                 const Distance& distance, CurveModel* model) {
  using Row = Eigen::Matrix<double, kSize, 1>;
  // Residuals in stretched standard deviations: twice_cost grows by stretch^2, its model does not.
  const double stretch = weighing.inliers_only ? 1.0 : weighing.stretch;
  const double inverse_sigma = 1.0 / (options.sigma_px * stretch);
  const double weight = options.weight * weighing.scale * stretch * stretch;
  double d[kChunk], s[kChunk], slope[kChunk], curvature[kChunk], total = 0.0;
  Row rows[kChunk];
  Row g = Row::Zero();
  Eigen::Matrix<double, kSize, kSize> h = Eigen::Matrix<double, kSize, kSize>::Zero();
  for (std::size_t first = 0; first < n; first += kChunk) {
    const std::size_t m = std::min(kChunk, n - first);
    for (std::size_t i = 0; i < m; ++i) {
      d[i] = inverse_sigma * distance(first + i, model != nullptr ? &rows[i] : nullptr);
      s[i] = d[i] * d[i];
    }
    total += weighing.inliers_only ? ApplyGate(weighing.gate, m, s, slope, curvature)
                                   : ApplyLoss(options.loss, m, s, slope, curvature);
    if (model == nullptr) continue;
    for (std::size_t i = 0; i < m; ++i) {
      g += (slope[i] * d[i]) * rows[i];
      for (int c = 0; c < kSize; ++c) {
        const double scaled = curvature[i] * rows[i][c];
        for (int r = c; r < kSize; ++r) h(r, c) += scaled * rows[i][r];
      }
    }
  }
  if (model != nullptr) {
    h.template triangularView<Eigen::StrictlyUpper>() = h.transpose();
    model->g = (weight * inverse_sigma) * g;
    model->h = (weight * inverse_sigma * inverse_sigma) * h;
    model->twice_cost = weight * total;
  }
  return weight * total;
}

// The same with the camera's shifts behind the curve's kCurve variables: mostly none or one of the
// distortion coefficients has derivatives.
template <int kCurve, typename Distance>
double SumWithCamera(std::size_t n, const ImagePoints::Options& options, const Weighing& weighing,
                     const Distance& distance, CurveModel* model) {
  if (options.num_distortion == 0)
    return SumPoints<kCurve + 4>(n, options, weighing, distance, model);
  if (options.num_distortion == 1)
    return SumPoints<kCurve + 5>(n, options, weighing, distance, model);
  const double cost = SumPoints<kCurve + kCameraSize>(n, options, weighing, distance, model);
  const int size = kCurve + 4 + options.num_distortion;
  model->g.conservativeResize(size);
  model->h.conservativeResize(size, size);
  return cost;
}

}  // namespace circline

#endif  // CIRCLINE_REFINE_POINT_SUMS_H_
