// What tells an ellipse from chance, and from blobs and rounded rectangles. Internal: not
// installed.
#ifndef CIRCLINE_RANSAC_DETECTION_ELLIPSE_SHAPE_H_
#define CIRCLINE_RANSAC_DETECTION_ELLIPSE_SHAPE_H_

#include <Eigen/Core>
#include <vector>

#include "circline/ransac/detection/calibrated_edges.h"
#include "circline/ransac/detection/contour_support.h"
#include "circline/ransac/detection/edges.h"

namespace circline {

double ToDegrees(double radians);

// Logarithm (base 10) of the number of ellipses as well supported that are expected among unrelated
// edges.
double Log10FalseAlarms(const Support& support, BrightSide bright);

// Median angle between the contour and the chains on which the points lie, degrees. `calibrated`
// has the points of `map`.
double SlopeDeg(const EdgeMap& map, const Eigen::Matrix3d& conic, const std::vector<int>& points,
                CalibratedEdges* calibrated);

// How far edges are from following a contour as those of an ellipse do: 1 is the most that a true
// rim shows.
struct EllipseShape {
  double rms_px = 0.0;     // Of the edge points to the contour.
  double slope_deg = 0.0;  // SlopeDeg.
  double size_px = 0.0;    // Geometric mean of the semi-axes.
  double noise = 0.0;      // Of one component of the gradient, grey levels per pixel.

  // `support` with its average strength.
  double Miss(const Support& support) const;
};

// Logarithm of the odds that a contour is the rim of a circle to that it is anything else, clutter
// or a blob; `miss` is its shape's.
double RimLogOdds(double log10_false_alarms, double miss);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_ELLIPSE_SHAPE_H_
