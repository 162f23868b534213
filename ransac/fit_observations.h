// Robust fits of what a front end brings: contours and segments in, conics, lines and vanishing
// points with covariances and inlier masks out.
#ifndef CIRCLINE_RANSAC_FIT_OBSERVATIONS_H_
#define CIRCLINE_RANSAC_FIT_OBSERVATIONS_H_

#include <cstdint>
#include <string>
#include <vector>

#include "circline/estimators/export.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/status.h"

namespace CIRCLINE_EXPORT circline {

// How robust fits are made.
struct FitOptions {
  // A point farther than kInlierSigmas standard deviations of its noise from its curve is an
  // outlier, and one farther than this, pixels of the photo; 0 = no cap.
  double inlier_threshold_px = 0.0;
  double confidence = 0.999;    // That the best model was among those drawn; in (0, 1).
  int max_iterations = 200000;  // Draws for each model; 1 or more.
  std::uint64_t seed = 1;       // Same input and seed, same bits out.
  // Of a point where the feature states none, pixels, to start with; > 0. The fit then follows the
  // scatter of the inliers (MeasurePointNoise), up to several times more and to any less.
  double sigma_px = 1.0;
  // Standard deviation of the angle of a contour's normals, where it has any, radians; in (0, 0.5].
  double direction_sigma_rad = 0.1;
  // What the points of one contour or line share, and what a line may miss the direction of its
  // pencil by: in the covariances, and in what an outlier of a pencil is.
  NoiseModel noise_model;

  // Ok, or a sentence that names the field which is wrong.
  Status Validate() const;
};

// Fills the fits of all circles, lines and pencils, and what of them are outliers: points, and
// lines that are not parallel to the others of their pencil. What cannot be fitted stays without a
// fit; `problems` (optional) receives one sentence for each, and for each such line, naming it.
// An ellipse that scattered points explain as well counts as none where it leaves points out;
// where it has them all, because they are few or their noise is as large as it, it is named. So is
// a stated noise that is a third of the true one or less and makes outliers of most points. A
// contour whose outliers hold an ellipse of their own has that as its second reading, and is named
// too: the first is the likelier one.
//
// Where the focal length is a guess (NoiseModel::camera, IsWide) and the lens bends, fits are made
// at the focal length at which they explain most: Observations::camera has that one then, and
// stated_focal_px the one given. Points are fitted at up to 15 focal lengths for it, at 25
// where what explains them is a narrow range.
//
// Where the lens is (NoiseModel::camera, k1 of 0.01 or more; not of a pinhole camera), fits are
// likewise made at the k1 at which they explain most: through a wrong one the ends of long lines
// would be left out, which tell k1, and k1 and the focal length would be biased and said to be
// sure. Observations::camera has that one then, and found_k1 what it has beyond the one given,
// about which the prior remains. Points are fitted at up to 25 k1 for it; lines of two points tell
// none.
//
// AdjustPhotos takes photos of one camera with the same, the one given: it sets it back.
//
// The returned status is not ok only for invalid options or observations.
Status FitObservations(const FitOptions& options, Observations* observations,
                       std::vector<std::string>* problems = nullptr);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_FIT_OBSERVATIONS_H_
