// An edge of a box: how well its direction is known, and the odds that it has one.
#ifndef CIRCLINE_RANSAC_DETECTION_STRUCTURE_BOX_EDGE_H_
#define CIRCLINE_RANSAC_DETECTION_STRUCTURE_BOX_EDGE_H_

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "circline/ransac/detection/lines/detect_lines.h"
#include "circline/ransac/detection/structure/line_odds.h"

namespace circline {

// The line's fit as that of an edge that may be worn, and bulge: with what all of its points share,
// and what lens and calibration leave.
LineFit WornEdge(const DetectedLine& line);

// Logarithm of the odds that a line, made of such a fit, which forms corners is an edge along the
// axis, which is off by a Gaussian error of that variance.
double LogOddsOfEdge(const LineOdds& line, const Eigen::Vector3d& axis, double off_variance);

// Logarithm of how much likelier lines[members] are along the direction than along any, with the
// errors and the prior odds of a box's edges.
double LogOddsOfDirection(const std::vector<DetectedLine>& lines, const std::vector<int>& members,
                          const Eigen::Vector3d& direction);

// Of each line those that it forms a corner with, indices, ascending. Twins and lines shorter than
// that have none.
std::vector<std::vector<std::size_t>> FindCorners(const std::vector<DetectedLine>& lines,
                                                  double diagonal_px, double min_length_px = 0.0);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_STRUCTURE_BOX_EDGE_H_
