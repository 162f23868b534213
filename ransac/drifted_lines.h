// Lines that drift off a pencil. Internal: not installed.
//
// Of many lines that run along a direction some are seen a few degrees off it: edges that step from
// one course of bricks to the next, far away. Those of one part of a photo are alike, and pass for
// a pencil of another direction, unless they are expected.
#ifndef CIRCLINE_RANSAC_DRIFTED_LINES_H_
#define CIRCLINE_RANSAC_DRIFTED_LINES_H_

#include <Eigen/Core>

#include "circline/estimators/export.h"
#include "circline/estimators/line.h"

namespace CIRCLINE_EXPORT circline {

// So many lines drift for each one that does not. Of the longest pencil of a photo, those within 12
// degrees of it that are none of its own, less those expected by what is further off: 0.07 on 62
// rendered tables, streets, pavements, wheels and rooms, 0.15 on scene-lund.
constexpr double kDriftShare = 0.1;

// Where a line was seen: its middle, a unit vector in front of the camera.
Eigen::Vector3d MiddleOf(const LineFit& line);

// How much likelier one that drifts off `direction` runs along another direction, at this middle,
// than a line of any orientation.
double DriftRatio(const Eigen::Vector3d& middle, const Eigen::Vector3d& direction,
                  const Eigen::Vector3d& other);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DRIFTED_LINES_H_
