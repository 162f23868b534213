// How noisy the points of each feature are, where nobody states it.
#ifndef CIRCLINE_ESTIMATORS_POINT_NOISE_H_
#define CIRCLINE_ESTIMATORS_POINT_NOISE_H_

#include <vector>

#include "circline/estimators/export.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/observations.h"

namespace CIRCLINE_EXPORT circline {

// Standard deviations of each coordinate of a point, pixels of the photo; all positive.
struct PointNoise {
  double conic_px = 0.0, line_px = 0.0;    // Common to the circles, to the lines.
  double line_worth = 1.0;                 // Residuals that line_px counts for where lines differ.
  std::vector<double> circles;             // By circle.
  std::vector<std::vector<double>> lines;  // By pencil, by line.
};

// A feature that states its noise has that. Any other has the scatter of its points about its own
// fit, shrunk towards the common noise of its kind; segments of two points have that of their
// pencil's segments about its vanishing point. The common noise is the median over the features,
// each counted by its degrees of freedom, shrunk towards the default, which is what a kind has
// where nothing is redundant; lines have that of the contours for a default where 20 contour points
// or more are redundant, worth ten residuals. Both priors are else worth one degree of freedom (a
// unit-information prior, Kass and Wasserman 1995): with 100 points, a circle that is four times as
// good as the others is given 1.09 times its noise. The square is the mean of the posterior: errors
// in these units have a variance of 1, few as the degrees of freedom f may be (Student's f / (f -
// 2)).
//
// Residuals that share an error (`model`) are fewer degrees of freedom (NoiseModel::Freedom).
//
// The scatter is fit->rms_px where the feature has an inlier mask (of kInlierSigmas); where
// it has none, outliers may be in force, and it is that of the points within three standard
// deviations, by the median absolute residual.
// 0.2 us a feature with a mask, 30 ns a point without (no lens distortion).
PointNoise MeasurePointNoise(const Observations& fitted,
                             const NoiseModel& model = NoiseModel::Exact(),
                             double conic_default_px = 0.3, double line_default_px = 0.4);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_POINT_NOISE_H_
