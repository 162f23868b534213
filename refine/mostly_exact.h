// Priors that are two Gaussians. Internal: not installed.
#ifndef CIRCLINE_REFINE_MOSTLY_EXACT_H_
#define CIRCLINE_REFINE_MOSTLY_EXACT_H_

#include <ceres/loss_function.h>

#include <cmath>

#include "circline/estimators/pencil_lean.h"

namespace circline {

// The mixture of a narrow Gaussian, with its share, and a wide one; standard deviations in those of
// the residual.
class TwoGaussians : public ceres::LossFunction {
 public:
  TwoGaussians(double narrow_share, double narrow, double wide)
      : steep_(1.0 / (narrow * narrow)),
        flat_(1.0 / (wide * wide)),
        narrow_peak_(narrow_share / narrow),
        wide_peak_((1.0 - narrow_share) / wide) {}

  void Evaluate(double s, double* rho) const override {
    const double exact = narrow_peak_ * std::exp(-0.5 * (steep_ - flat_) * s);
    const double sum = exact + wide_peak_, p = exact / sum;
    rho[0] = flat_ * s - 2.0 * std::log(sum / (narrow_peak_ + wide_peak_));
    rho[1] = flat_ + (steep_ - flat_) * p;
    rho[2] = -0.5 * (steep_ - flat_) * (steep_ - flat_) * p * (1.0 - p);
  }

 private:
  double steep_, flat_, narrow_peak_, wide_peak_;
};

// Most axes and lines, of boards and doors, are exact, most prints do not bleed; the walls of old
// houses lean by a degree. Of a residual in standard deviations, the mixture of a Gaussian so many
// times as narrow and one somewhat wider: where all are near, exact; where they contradict each
// other, a compromise. Covariances count the residual's own Gaussian all the same, and axes one
// that leans (LeanShape).
class MostlyExact final : public TwoGaussians {
 public:
  explicit MostlyExact(double narrower = kNarrower)
      : TwoGaussians(kExact, 1.0 / narrower, kLeaning) {}

  static constexpr double kNarrower = 8.0;  // Of 3, 6 and 8, on photographs of boards.
  // Of axes seen through a camera whose focal length is unknown: that makes any corner exact. Of 1,
  // 3 and 8, on simulated streets (seeds 1 and 2) and chessboard-opencv.
  static constexpr double kNarrowerOfGuess = 3.0;

 private:
  // Of 0.1 to 0.8, on streets (scene-lund, -more) and a bent sheet (robot10x10).
  static constexpr double kExact = 0.5;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_MOSTLY_EXACT_H_
