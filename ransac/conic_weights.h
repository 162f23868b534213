// What each point says for an ellipse, for the final fits of robust_conic.h. Internal: not
// installed.
#ifndef CIRCLINE_RANSAC_CONIC_WEIGHTS_H_
#define CIRCLINE_RANSAC_CONIC_WEIGHTS_H_

#include <cstdint>
#include <vector>

#include "circline/ransac/conic_model.h"

namespace circline {

// Inlier weights as InlierWeights (ransac.h) has them, but with the densities of curve and
// background measured sector by sector: where a contour has a gap, a stray point near the ellipse
// gets no say; it would bend the free part.
struct ConicWeights {
  std::vector<float> weights;     // By the model's order.
  double sigma = 0.0;             // Of the noise, pixels: in (0 = not known) and out.
  std::vector<double> residuals;  // Workspace, as are those below.
  std::vector<double> misses;
  std::vector<std::uint8_t> sectors;

  // Logarithm of the ratio of likelihoods: curve with background over background alone.
  double LogLikelihood() const;
};

// Weights of the model's data for the ellipse `value`; `threshold` in pixels. Reads and updates
// result->sigma.
void WeighConic(const ConicModel& model, const ConicModel::Value& value, double threshold,
                ConicWeights* result);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_CONIC_WEIGHTS_H_
