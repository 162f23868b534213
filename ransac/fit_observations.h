// Robust fits of what a front end brings: contours and segments in, conics, lines and vanishing
// points with covariances and inlier masks out.
#ifndef CIRCLINE_RANSAC_FIT_OBSERVATIONS_H_
#define CIRCLINE_RANSAC_FIT_OBSERVATIONS_H_

#include <cstdint>
#include <string>
#include <vector>

#include "circline/estimators/observations.h"
#include "circline/estimators/status.h"

namespace circline {

struct FitOptions {
  // A point farther than this from its curve is an outlier, pixels of the photo; > 0. Where a
  // feature states sigma_px, the smaller of this and 3.03 sigma_px (99.8 % of a Gaussian's points)
  // is taken.
  double inlier_threshold_px = 2.0;
  double confidence = 0.999;    // That the best model was among those drawn; in (0, 1).
  int max_iterations = 200000;  // Draws for each model; 1 or more.
  std::uint64_t seed = 1;       // Same input and seed, same bits out.
  double sigma_px = 1.0;        // Of a point where the feature states none; > 0.
  // Standard deviation of the angle of a contour's normals, where it has any, radians; in (0, 0.5].
  double direction_sigma_rad = 0.1;

  Status Validate() const;
};

// Fills the fits of all circles, lines and pencils. What cannot be fitted stays without a fit;
// `problems` (optional) receives one sentence for each, naming it. The returned status is not ok
// only for invalid options or observations.
Status FitObservations(const FitOptions& options, Observations* observations,
                       std::vector<std::string>* problems = nullptr);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_FIT_OBSERVATIONS_H_
