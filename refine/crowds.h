// Outliers that lie in one place may look like a piece of a curve, to a fit and to a robust loss
// alike. What gives them away is that they crowd: the points of a contour are strung along it.
// Internal: not installed.
#ifndef CIRCLINE_REFINE_CROWDS_H_
#define CIRCLINE_REFINE_CROWDS_H_

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "circline/estimators/observations.h"
#include "circline/estimators/robust_loss.h"
#include "circline/refine/estimate_pose.h"

namespace circline {

// A redescending loss judges for itself which points are outliers; under the others those that a
// robust fit has found are left out.
bool Redescends(LossType type);

// A robust fit has found so many outliers that it may itself have followed some.
bool IsContaminated(const std::vector<std::uint8_t>& inliers);

// 1 for each point but those with far more neighbours within five standard deviations than the
// less crowded quarter of the points has.
std::vector<std::uint8_t> NotCrowded(const std::vector<Eigen::Vector2d>& pixels, double sigma_px);

// Fits contaminated features again without their crowds, masks included, where the loss redescends
// and the noise is stated; and then the pencils they belong to.
void RefitWithoutCrowds(const EstimationOptions& options, Observations* observations);

}  // namespace circline

#endif  // CIRCLINE_REFINE_CROWDS_H_
