// What a residual costs in the robust estimator, and what it weighs in a refit.
#ifndef CIRCLINE_RANSAC_RANSAC_LOSS_H_
#define CIRCLINE_RANSAC_RANSAC_LOSS_H_

#include <vector>

namespace circline {

enum class ScoreType {
  kMsac,    // min(r^2 / T^2, 1): truncated least squares.
  kMagsac,  // The same truncated at T, averaged over all noise levels that T admits (MAGSAC++).
};

// The loss of a datum as a function of u = r^2 / T^2, in [0, 1], 1 for u >= 1; and the weight
// (derivative, scaled to 1 at most, 0 for u >= 1) with which a refit takes it.
class RansacLoss {
 public:
  explicit RansacLoss(ScoreType type);
  float Value(float u) const {
    if (!(u < 1.0f)) return 1.0f;
    return type_ == ScoreType::kMsac ? u : MarginalValue(u);
  }
  float Weight(float u) const {
    if (!(u < 1.0f)) return 0.0f;
    // Tukey's, not the truncated square's own step: a datum that crosses the threshold must not
    // make the iteration jump.
    return type_ == ScoreType::kMsac ? (1.0f - u) * (1.0f - u) : MarginalWeight(u);
  }

 private:
  static float MarginalValue(float u);
  static float MarginalWeight(float u);

  ScoreType type_;
};

// Inlier weights for a final, statistically efficient fit: the posterior probability that a datum
// belongs to the Gaussian about the model rather than to a uniform background, whose density is
// measured between one and three thresholds beside the model; 0 beyond the threshold. On clean data
// that is least squares on the inliers, on contaminated data a redescending M-estimator. `sigma`:
// in, the current standard deviation of the noise (0: threshold / kInlierSigmas), out, its new
// estimate, with `num_parameters` degrees of freedom spent. Returns the sum of the weights.
double InlierWeights(const std::vector<double>& residuals, double threshold, int num_parameters,
                     double* sigma, std::vector<double>* weights);

// Root mean square residual of the inliers: of a Gaussian on a uniform background, whose density is
// measured between two and four thresholds, by expectation maximisation on the residuals within two
// - so that a threshold which is too narrow for the noise does not cut the noise down to itself.
double InlierRms(const std::vector<double>& residuals, double threshold);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_RANSAC_LOSS_H_
