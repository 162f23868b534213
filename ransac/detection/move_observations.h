// Where the features of one photo are expected on the next. Internal: not installed.
#ifndef CIRCLINE_RANSAC_DETECTION_MOVE_OBSERVATIONS_H_
#define CIRCLINE_RANSAC_DETECTION_MOVE_OBSERVATIONS_H_

#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"

namespace circline {

// The features as a camera at `next` sees them; see FeatureFollower::Move. Of contours and lines
// only a few points are kept: fits and directions tell the rest.
Observations MoveObservations(const Observations& observations, const PoseHypothesis& last,
                              const CameraPose& next);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_MOVE_OBSERVATIONS_H_
