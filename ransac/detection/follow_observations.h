// The steps of FeatureFollower (those of move_observations.cc and keep_names.cc, too). Internal:
// not installed.
#ifndef CIRCLINE_RANSAC_DETECTION_FOLLOW_OBSERVATIONS_H_
#define CIRCLINE_RANSAC_DETECTION_FOLLOW_OBSERVATIONS_H_

#include <opencv2/core.hpp>

#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/status.h"
#include "circline/ransac/detection/feature_follower.h"

namespace circline {

// Circles and lines of edges.
int CountFeatures(const Observations& observations);

// Those of the predicted features that are found within `search_px`, with the ids, planes and roles
// of the prediction; and what to `expect` from here: the same, and what was not found where it was
// predicted. Not ok as DetectObservations.
Status FollowObservations(const cv::Mat& image, const Observations& predicted, double search_px,
                          const DetectionOptions& options, Observations* found,
                          Observations* expect);

// The features as a camera at `next` sees them; see FeatureFollower::Move. Of contours and lines
// only a few points are kept: fits and directions tell the rest.
Observations MoveObservations(const Observations& observations, const PoseHypothesis& last,
                              const CameraPose& next);

// Names what was detected cold after the predicted features that it continues, and the rest anew:
// circles whose centre lies within `search_px`, or within half of their own semi-minor axis, of the
// predicted one and that are as large to a factor of 1.5; pencils that share half of their lines.
// What goes on keeps its plane, role and radius, and comes first, in the order of the prediction.
// Nothing goes on where fewer than half of the circles and pencils would. Returns how many do.
int KeepNames(const Observations& predicted, double search_px, NextNames* next,
              Observations* detected);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_FOLLOW_OBSERVATIONS_H_
