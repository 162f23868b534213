// One step of least squares for a conic.
#include <Eigen/Core>
#include <cmath>

#include "circline/estimators/conic.h"
#include "circline/estimators/conic_moments.h"
#include "circline/ransac/conic_model.h"

namespace circline {

// Hyper-renormalisation (Kanatani, Al-Sharadqah, Chernov, Sugaya, ECCV 2012): the closed form for
// points that weigh as the gradient per pixel of the current conic tells, so that distances in
// pixels are what it minimises.
bool ConicModel::Refine(const float* weights, Value* value) const {
  const Eigen::Matrix3d conic = ToMatrix(*value);
  const auto sum_about = [&](const Eigen::Vector2d& center, int* count) {
    Moments sums;
    *count = 0;
    for (int i = 0; i < NumData(); ++i) {
      if (!(weights[i] > 0.0f)) continue;
      const CalibratedPoint& p = Point(i);
      const Eigen::Vector2d gradient = p.GradientPerPixel((conic * p.Homogeneous()).head<2>());
      const Eigen::Vector2d x = p.x - center;
      sums.Add(x.x(), x.y(), static_cast<double>(weights[i]) / gradient.squaredNorm());
      ++*count;
    }
    return sums;
  };
  int count = 0;
  const Moments sums = sum_about(Eigen::Vector2d::Zero(), &count);
  if (count < kMinSamples) return false;
  const Eigen::Vector2d mean = Eigen::Vector2d(sums.x, sums.y) / sums.one;
  const Moments moments = sum_about(mean, &count);
  const double scale = std::sqrt(0.5 * (moments.xx + moments.yy) / moments.one);
  Eigen::Matrix3d fitted;
  if (!(scale > 0.0) || !FitEllipse(moments.Mean(scale), &fitted)) return false;
  const Normalization normalization{mean.x(), mean.y(), scale};
  Value moved = ToValue(TransformConic(fitted, normalization.Matrix()));
  if (!Normalize(&moved)) return false;
  *value = moved;
  return true;
}

}  // namespace circline
