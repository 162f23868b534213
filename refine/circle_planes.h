// The planes that a circle's fit allows, with what it knows of them. Internal: not installed.
#ifndef CIRCLINE_REFINE_CIRCLE_PLANES_H_
#define CIRCLINE_REFINE_CIRCLE_PLANES_H_

#include <Eigen/Core>
#include <array>

#include "circline/estimators/circle_pose.h"
#include "circline/estimators/conic_fit.h"

namespace circline {

struct CirclePlane {
  CirclePose pose;
  // Of the turns, a x b, from a normal a with another error to this one, b; radians.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

// How many there are, as of CirclePoses; 0 where an error of one standard deviation leads to no
// circle or to another number of them.
int CirclePlanes(const ConicFit& fit, std::array<CirclePlane, 2>* planes);

}  // namespace circline

#endif  // CIRCLINE_REFINE_CIRCLE_PLANES_H_
