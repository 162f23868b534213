// The prior of what is mostly exact. Internal: not installed.
#ifndef CIRCLINE_REFINE_MOSTLY_EXACT_H_
#define CIRCLINE_REFINE_MOSTLY_EXACT_H_

#include <ceres/loss_function.h>

#include <cmath>

namespace circline {

// Most axes and lines, of boards and doors, are exact, most prints do not bleed; the walls of old
// houses lean by a degree. Of a residual in standard deviations, the mixture of a Gaussian so many
// times as narrow and one somewhat wider: where all are near, exact; where they contradict each
// other, a compromise. The covariance is that of the residual's Gaussian all the same.
class MostlyExact final : public ceres::LossFunction {
 public:
  void Evaluate(double s, double* rho) const override {
    constexpr double kNarrower = 8.0;  // Of 3, 6 and 8, on photographs of boards.
    // Of 0.1 to 0.8, and 1 to 3, on streets (scene-lund, -more) and a bent sheet (robot10x10).
    constexpr double kExact = 0.5, kWider = 1.5;
    constexpr double kSteep = kNarrower * kNarrower, kFlat = 1.0 / (kWider * kWider);
    constexpr double kWide = (1.0 - kExact) / kWider, kPeak = kExact * kNarrower;
    const double exact = kPeak * std::exp(-0.5 * (kSteep - kFlat) * s), sum = exact + kWide;
    const double p = exact / sum;
    rho[0] = kFlat * s - 2.0 * std::log(sum / (kPeak + kWide));
    rho[1] = kFlat + (kSteep - kFlat) * p;
    rho[2] = -0.5 * (kSteep - kFlat) * (kSteep - kFlat) * p * (1.0 - p);
  }
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_MOSTLY_EXACT_H_
