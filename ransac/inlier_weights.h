// What residuals say of who belongs to a model, and of the noise.
#ifndef CIRCLINE_RANSAC_INLIER_WEIGHTS_H_
#define CIRCLINE_RANSAC_INLIER_WEIGHTS_H_

#include <vector>

#include "circline/estimators/export.h"

namespace CIRCLINE_EXPORT circline {

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

#endif  // CIRCLINE_RANSAC_INLIER_WEIGHTS_H_
