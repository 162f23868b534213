// Poses of one imaged circle (proposition 3 of Wang, Wu and Ji 2007, their section 4).
#ifndef CIRCLINE_ESTIMATORS_CIRCLE_POSE_H_
#define CIRCLINE_ESTIMATORS_CIRCLE_POSE_H_

#include <Eigen/Core>
#include <array>

#include "circline/estimators/export.h"

namespace CIRCLINE_EXPORT circline {

// A circle in space, camera frame, lengths in units of its radius.
struct CirclePose {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  // Unit; faces the camera: normal . center < 0.
  Eigen::Vector3d center =
      Eigen::Vector3d::Zero();  // In front of the camera; |center| = distance / radius.
};

// The circles whose image is the ellipse `conic` (calibrated, any scale). Returns how many were
// written: 2; 1 where both coincide to rounding (the plane is parallel to the image of the circle's
// own cone: tilt 0); 0 where the conic is not a proper ellipse. The order has no meaning.
// Exact to rounding; the normal of a circle seen at `tilt` radians from frontal is good to 1e-15 /
// tilt, never worse than 1e-7. 0.11 us.
int CirclePoses(const Eigen::Matrix3d& conic, std::array<CirclePose, 2>* poses);

// The reverse: image of the circle of radius 1 at `pose`, calibrated, unit Frobenius norm, negative
// inside. Of a circle without IsInView it is the conic of the rays through the circle in both
// senses, which no camera sees.
Eigen::Matrix3d ProjectCircle(const CirclePose& pose);

// Whether the camera sees an ellipse: all of the circle lies in front of it (Z > 0), and the plane
// misses the camera centre. The normal need not be a unit vector.
bool IsInView(const CirclePose& pose);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_CIRCLE_POSE_H_
