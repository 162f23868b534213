// What tells an ellipse from chance, and from blobs and rounded rectangles. Internal: not
// installed.
#ifndef CIRCLINE_RANSAC_DETECTION_ELLIPSES_ELLIPSE_SHAPE_H_
#define CIRCLINE_RANSAC_DETECTION_ELLIPSES_ELLIPSE_SHAPE_H_

#include <Eigen/Core>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/ransac/detection/calibrated_edges.h"
#include "circline/ransac/detection/edges.h"
#include "circline/ransac/detection/ellipses/contour_support.h"

namespace circline {

inline double ToDegrees(double radians) { return radians / kDegree; }

// Logarithm (base 10) of the number of ellipses as well supported that are expected among unrelated
// edges.
double Log10FalseAlarms(const Support& support, BrightSide bright);

// Median angle between the contour and the chains on which the points lie, degrees. `calibrated`
// has the points of `map`.
double SlopeDeg(const EdgeMap& map, const Eigen::Matrix3d& conic, const std::vector<int>& points,
                CalibratedEdges* calibrated);

// How far edges are from following a contour as those of an ellipse do: 1 is the most that a true
// rim shows. `support` with its average strength; `rms_px` of the edge points to the contour;
// `slope_deg` by SlopeDeg; `size_px` the geometric mean of the semi-axes; `noise` of one component
// of the gradient, grey levels per pixel.
double ShapeDeviation(const Support& support, double rms_px, double slope_deg, double size_px,
                      double noise);

// Logarithm of the odds that a contour is the rim of a circle to that it is anything else, clutter
// or a blob; `deviation` is its shape's.
double RimLogOdds(double log10_false_alarms, double deviation);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_ELLIPSES_ELLIPSE_SHAPE_H_
