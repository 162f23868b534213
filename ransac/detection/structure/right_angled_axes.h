// Rotations that three lines have an axis each of.
#ifndef CIRCLINE_RANSAC_DETECTION_STRUCTURE_RIGHT_ANGLED_AXES_H_
#define CIRCLINE_RANSAC_DETECTION_STRUCTURE_RIGHT_ANGLED_AXES_H_

#include <Eigen/Core>
#include <vector>

namespace circline {

// The rotations, two or none, whose columns are at right angles to the unit vectors a, b and c in
// this order: directions in space, camera frame, of three lines with these calibrated
// representations, if each is along another axis of a box. Axes have no sense: of the rotations
// that differ in signs only, one.
std::vector<Eigen::Matrix3d> RightAngledAxes(const Eigen::Vector3d& a, const Eigen::Vector3d& b,
                                             const Eigen::Vector3d& c);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_STRUCTURE_RIGHT_ANGLED_AXES_H_
