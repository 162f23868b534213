// How else a pencil at right angles to another may run. Internal: not installed.
#ifndef CIRCLINE_RANSAC_DETECTION_DIRECTION_READINGS_H_
#define CIRCLINE_RANSAC_DETECTION_DIRECTION_READINGS_H_

#include <Eigen/Core>
#include <vector>

#include "circline/estimators/line.h"
#include "circline/estimators/observations.h"

namespace circline {

// Directions about `direction`, turned about `axis`, and how probable each is by all of `lines`: a
// mixture of `num_own` lines along it, which leans from the right angle to the axis by what walls
// do (kRightAngleSigmaDeg, integrated over), and others that run any way. A fit that knows which
// lines are its own misses that others might be.
std::vector<DirectionReading> ReadDirection(const std::vector<LineFit>& lines,
                                            const Eigen::Vector3d& axis,
                                            const Eigen::Vector3d& direction, int num_own);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_DIRECTION_READINGS_H_
