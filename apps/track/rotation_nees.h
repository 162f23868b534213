// How well a pose's error agrees with the standard deviations that it states.
#ifndef CIRCLINE_APPS_TRACK_ROTATION_NEES_H_
#define CIRCLINE_APPS_TRACK_ROTATION_NEES_H_

#include <optional>

#include "apps/common/scene.h"
#include "circline/estimators/pose.h"

namespace circline::apps {

// Squared error of the rotation in standard deviations, by its degrees of freedom (3; 2 where only
// the normal is known): 1 on average. The truth is the nearest of what the evidence cannot tell
// apart. Absent without a truth, or where more than the turn about the normal is free.
std::optional<double> RotationNees(const PoseHypothesis& hypothesis, const SceneImage& image);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_TRACK_ROTATION_NEES_H_
