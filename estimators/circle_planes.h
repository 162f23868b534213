// The planes that a circle's image allows, with what it knows of them. Internal: not installed, but
// shown to the other libraries.
#ifndef CIRCLINE_ESTIMATORS_CIRCLE_PLANES_H_
#define CIRCLINE_ESTIMATORS_CIRCLE_PLANES_H_

#include <Eigen/Core>
#include <array>

#include "circline/estimators/circle_pose.h"
#include "circline/estimators/conic_fit.h"
#include "circline/estimators/export.h"

namespace CIRCLINE_EXPORT circline {

struct CirclePlane {
  CirclePose pose;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // Of the unit normal.
};

// How many there are, as of CirclePoses.
int CirclePlanes(const ConicFit& fit, std::array<CirclePlane, 2>* planes);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_CIRCLE_PLANES_H_
