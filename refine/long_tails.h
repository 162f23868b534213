// The prior of what is mostly exact. Internal: not installed.
#ifndef CIRCLINE_REFINE_LONG_TAILS_H_
#define CIRCLINE_REFINE_LONG_TAILS_H_

#include <ceres/loss_function.h>

#include <cmath>

namespace circline {

// Most axes and lines, of boards and doors, are exact, most prints do not bleed, and the others are
// off by far more than their average: near zero this prior is kNarrower times as narrow as a
// Gaussian of the standard deviation that the residual is counted in, and beyond it wider (Cauchy's
// loss). The covariance is that of the Gaussian all the same.
class LongTails final : public ceres::LossFunction {
 public:
  void Evaluate(double s, double* rho) const override {
    constexpr double kNarrower = 8.0;  // Of 3, 6 and 8, on photographs of boards.
    constexpr double kCauchy2 = 2.385 * 2.385;
    constexpr double kSlope = kNarrower * kNarrower;
    const double by = 1.0 / (1.0 + kSlope * s / kCauchy2);
    rho[0] = kCauchy2 * std::log1p(kSlope * s / kCauchy2);
    rho[1] = kSlope * by;
    rho[2] = -kSlope * kSlope / kCauchy2 * by * by;
  }
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_LONG_TAILS_H_
