// Photos whose poses are known up to where, how large and how turned the world is: which circles of
// one are which of another, and where they lie. Internal: not installed.
#ifndef CIRCLINE_REFINE_GIVEN_POSES_H_
#define CIRCLINE_REFINE_GIVEN_POSES_H_

#include <ceres/cost_function.h>

#include <optional>
#include <vector>

#include "circline/estimators/pose.h"
#include "circline/refine/adjust_layout.h"
#include "circline/refine/adjust_photos.h"

namespace circline {

// A pose against one of another frame and unit, X_other = s R X + t: rotation, translation, those
// of R (4) and t (3), log s (1). `rotation`, `translation`: the camera's in the other frame; the
// deviation of the translation in the unit of the world.
ceres::CostFunction* NewGivenPosePrior(const Eigen::Matrix3d& rotation,
                                       const Eigen::Vector3d& translation, double rotation_sigma,
                                       double translation_sigma);

// The pose in the world of a photo that has the given one.
CameraPose PoseInWorld(const GivenFrame& world, const CameraPose& given);

// Where the world lies, and the photos' circles and directions in it. `estimates`: each photo's
// own, the unit of each another one. None where no circle is found in two of them.
std::optional<GivenFrame> PlaceByGivenPoses(const std::vector<PoseEstimate>& estimates,
                                            const std::vector<std::optional<CameraPose>>& given,
                                            SharedLayout* shared);

}  // namespace circline

#endif  // CIRCLINE_REFINE_GIVEN_POSES_H_
