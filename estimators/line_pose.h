// Rotations from directions (propositions 1, 2, 4 and 5), all in calibrated coordinates, where a
// vanishing point is a direction and the vanishing line of a plane is its normal.
#ifndef CIRCLINE_ESTIMATORS_LINE_POSE_H_
#define CIRCLINE_ESTIMATORS_LINE_POSE_H_

#include <Eigen/Core>
#include <array>

#include "circline/estimators/export.h"

namespace CIRCLINE_EXPORT circline {

// R = [r1 r2 r3] with r1 along `x_direction` and r3 along the plane normal x_direction x
// y_direction: proposition 5, for any angle between the two. Signs as given. False where the
// directions coincide to within 1e-12 rad or are not finite. 30 ns.
bool RotationFromDirections(const Eigen::Vector3d& x_direction, const Eigen::Vector3d& y_direction,
                            Eigen::Matrix3d* rotation);

// The same where the two are known to be orthogonal and noise says otherwise: the orthonormal pair
// in their plane that splits the deviation in proportion to the variances (rad^2, in that plane).
// The paper's projection by SVD is the case of equal variances.
bool RotationFromOrthogonalDirections(const Eigen::Vector3d& x_direction, double x_variance,
                                      const Eigen::Vector3d& y_direction, double y_variance,
                                      Eigen::Matrix3d* rotation);

// The four right-handed rotations that differ by the senses of the axes.
std::array<Eigen::Matrix3d, 4> SignChoices(const Eigen::Matrix3d& rotation);

// True if a point of the plane with normal `normal` moves along +`direction` (both camera frame)
// when its image moves from x0 to x1 (calibrated, homogeneous). Signs of `normal` do not matter.
bool MovesAlong(const Eigen::Vector3d& direction, const Eigen::Vector3d& normal,
                const Eigen::Vector3d& x0, const Eigen::Vector3d& x1);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_LINE_POSE_H_
