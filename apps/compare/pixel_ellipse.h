// Observed curves as shapes in the photo, for files and pictures.
#ifndef CIRCLINE_APPS_COMPARE_PIXEL_ELLIPSE_H_
#define CIRCLINE_APPS_COMPARE_PIXEL_ELLIPSE_H_

#include "circline/estimators/conic.h"
#include "circline/estimators/observations.h"

namespace circline::apps {

struct PixelEllipse {
  Ellipse ellipse;        // Best fitted to the inlier points, pixels of the photo as taken.
  double coverage = 0.0;  // Share of the full turn (of the eccentric anomaly) that has points.
  int num_points = 0;     // Inliers.
};

// False, with only `num_points` filled, where no ellipse fits.
bool FitPixelEllipse(const CircleObservation& circle, PixelEllipse* result);

// The two inlier points of a line that lie farthest apart along it.
Segment EndPoints(const LineObservation& line);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_PIXEL_ELLIPSE_H_
