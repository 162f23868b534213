// Several ellipses from one set of contour points.
#ifndef CIRCLINE_RANSAC_FIND_CONICS_H_
#define CIRCLINE_RANSAC_FIND_CONICS_H_

#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/conic_fit.h"
#include "circline/estimators/status.h"
#include "circline/ransac/conic_model.h"
#include "circline/ransac/ransac.h"

namespace circline {

struct FindConicsOptions {
  RobustFitOptions fit;  // Of each ellipse; see FitConicRobust.
  ConicLimits limits;
  int max_conics = 10;  // Ellipses to look for; 0 or more.
  int min_points = 10;  // Fewest points of an ellipse; 6 or more (five always lie on a conic).
  // An ellipse is kept if fewer than this many as good are expected among as many stray points
  // (number of false alarms; Desolneux, Moisan, Morel, IJCV 2000); > 0.
  double max_false_alarms = 0.01;

  Status Validate() const;
};

struct FoundConic {
  ConicFit fit;
  std::vector<int> points;  // Indices of its inliers, ascending.
  // Natural logarithm of the number of ellipses this good expected by chance; very negative = sure.
  double log_false_alarms = 0.0;
};

// The ellipses of a set of points, the best supported first. One ellipse after the other is found
// among the points that are left, and takes its inliers away; the search stops at max_conics, or
// when the best ellipse left has fewer than min_points points or more than max_false_alarms. An
// "ellipse" whose inside is as full as its band is a blob of clutter, which is taken away and not
// counted. Then every point goes to the ellipse that it misses least (within the threshold), each
// ellipse is fitted again without the points of the others, and ellipses that no longer meet the
// conditions are dropped. No point is in two ellipses. An empty answer is ok. `directions` as in
// FitConicRobust.
Status FindConics(const std::vector<CalibratedPoint>& points, const FindConicsOptions& options,
                  std::vector<FoundConic>* conics, const EdgeDirections* directions = nullptr);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_FIND_CONICS_H_
