// Convex arcs of edge chains: pieces without corners and inflexions, which an ellipse could
// contain.
#ifndef CIRCLINE_RANSAC_DETECTION_ELLIPSES_ARCS_H_
#define CIRCLINE_RANSAC_DETECTION_ELLIPSES_ARCS_H_

#include <Eigen/Core>
#include <vector>

#include "circline/ransac/detection/edges.h"

namespace circline {

// points[begin] .. points[end - 1] of an edge map, in order, bending to one side only.
struct Arc {
  int begin = 0, end = 0;
  bool bright_inside = false;                   // It bends towards the brighter side.
  double turn = 0.0;                            // Of its tangent from end to end, radians.
  Eigen::Vector2d first, middle, last;          // Pixels.
  Eigen::Vector2d first_tangent, last_tangent;  // Unit, along the walk.

  int size() const { return end - begin; }
};

// Cuts all chains at sharp corners, and where the bend changes sides. What is left straight is no
// arc. Blunt corners, which the smoothing rounds, may stay inside an arc: see SplitArc.
std::vector<Arc> FindArcs(const EdgeMap& map);

// The two parts of an arc on either side of its sharpest point, where a corner may have been
// rounded by the smoothing. Parts that are no arcs are left out.
std::vector<Arc> SplitArc(const EdgeMap& map, const Arc& arc);

// Whether one ellipse can contain both: each is on the inner side of the other. A quick filter; no
// promise.
bool CanShareEllipse(const Arc& a, const Arc& b);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_ELLIPSES_ARCS_H_
