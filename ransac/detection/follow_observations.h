// The steps of FeatureFollower: one photo with predicted features. Internal: not installed.
#ifndef CIRCLINE_RANSAC_DETECTION_FOLLOW_OBSERVATIONS_H_
#define CIRCLINE_RANSAC_DETECTION_FOLLOW_OBSERVATIONS_H_

#include <opencv2/core.hpp>

#include "circline/estimators/observations.h"
#include "circline/estimators/status.h"
#include "circline/ransac/detection/detect_observations.h"

namespace circline {

// Circles and lines of edges.
int CountFeatures(const Observations& observations);

// Those of the predicted features that are found within `search_px`, with the ids, planes and roles
// of the prediction; and what to `expect` from here: the same, and what was not found where it was
// predicted. Not ok as DetectObservations.
Status FollowObservations(const cv::Mat& image, const Observations& predicted, double search_px,
                          const DetectionOptions& options, Observations* found,
                          Observations* expect);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_FOLLOW_OBSERVATIONS_H_
