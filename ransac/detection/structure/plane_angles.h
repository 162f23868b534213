// How much likelier three directions of one plane are at given angles than at any. Internal: not
// installed.
#ifndef CIRCLINE_RANSAC_DETECTION_STRUCTURE_PLANE_ANGLES_H_
#define CIRCLINE_RANSAC_DETECTION_STRUCTURE_PLANE_ANGLES_H_

#include "circline/ransac/detection/structure/uncertain_direction.h"

namespace circline {

// Ratio of the likelihoods that `second` and `third` are `second_rad` and `third_rad` from `first`,
// both to the left or both to the right, as exactly as houses are made, and that each of them runs
// any way in the plane. `first` and `second` span it. As one focal length fits one angle, and two
// only where they are as given, the ratio tells where it does.
double AnglesInPlane(const UncertainDirection& first, const UncertainDirection& second,
                     const UncertainDirection& third, const CameraError& camera, double second_rad,
                     double third_rad);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_STRUCTURE_PLANE_ANGLES_H_
