// A tracked hypothesis as users see it. Internal: not installed.
#ifndef CIRCLINE_REFINE_TRACK_RESULT_H_
#define CIRCLINE_REFINE_TRACK_RESULT_H_

#include <string>
#include <vector>

#include "circline/estimators/pose.h"
#include "circline/refine/track_frame.h"
#include "circline/refine/track_state.h"

namespace circline {

// Pose, covariance, free directions, circles and directions of the map; everything but the
// probability and what a frame says of it.
PoseHypothesis HypothesisOf(const TrackMap& map, const TrackState& state, const Camera& camera);

// PoseEstimate::decided_by, of ranked hypotheses.
std::string DecidedByFrames(const std::vector<PoseHypothesis>& hypotheses);

// What a frame says of a hypothesis: inliers, cost, what was left out and in words why.
void FillFrame(const TrackFrame& frame, const TrackFit& fit, PoseHypothesis* hypothesis,
               std::vector<std::string>* notes);

}  // namespace circline

#endif  // CIRCLINE_REFINE_TRACK_RESULT_H_
