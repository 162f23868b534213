// Ellipses that are images of circles, from edge chains.
//
// Chains are cut at corners and inflexions into convex arcs; an arc, or two arcs that can lie on
// one convex curve, give a candidate; the candidate is confronted with all edge points along its
// contour and fitted to those that agree in place and direction. All fits happen in calibrated
// coordinates, so that lens distortion neither bends a candidate away from its contour nor biases
// it, and what is fitted is always a general ellipse: nothing is ever rounded to a circle. The
// final fit is to edge points from which the bias of a bent edge has been taken (CurvatureBias). A
// contour too ragged for an ellipse gets a second look through a wider Gaussian. Around each
// ellipse found, other rims about its centre are looked for, whose arcs may be too short to tell an
// ellipse. What hides a part of a rim may have a round edge of its own, an arc where the rim has
// none: that is not told as an ellipse.
#ifndef CIRCLINE_RANSAC_DETECTION_ELLIPSES_DETECT_ELLIPSES_H_
#define CIRCLINE_RANSAC_DETECTION_ELLIPSES_DETECT_ELLIPSES_H_

#include <Eigen/Core>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/conic_fit.h"
#include "circline/ransac/detection/edges.h"

namespace circline {

struct EllipseOptions {
  double min_axis_px = 3.0;  // Smallest semi-minor axis; > 0.
  // Smallest share of the contour that edges support, of 360; in (0, 360].
  double min_arc_deg = 100.0;
};

struct DetectedEllipse {
  ConicFit fit;             // Calibrated; residuals in pixels of the photo.
  std::vector<int> points;  // Its edge points, indices into EdgeMap::points, once around.
  // Where these (or those of a second look, more smoothed) lie once what the contour's bend did to
  // them is undone (CurvatureBias): what the fit was made to, pixels.
  std::vector<Eigen::Vector2d> contour;
  double sigma_px = 0.0;      // Standard deviation of a point about the ellipse.
  double coverage_deg = 0.0;  // Share of the contour that has edge points, times 360.
  double length_px = 0.0;     // Length of that share.
  BrightSide bright = BrightSide::kOutside;
  // Ellipses with the same number can be circles about one centre, and differ by more in size than
  // the two edges of one thick rim do; -1 = alone.
  int concentric = -1;
};

// Best supported first. `camera` must be valid.
std::vector<DetectedEllipse> DetectEllipses(const EdgeMap& edges, const Camera& camera,
                                            const EllipseOptions& options);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_ELLIPSES_DETECT_ELLIPSES_H_
