// A tracked hypothesis as users see it. Internal: not installed.
#ifndef CIRCLINE_REFINE_TRACK_RESULT_H_
#define CIRCLINE_REFINE_TRACK_RESULT_H_

#include <string>
#include <vector>

#include "circline/estimators/pose.h"
#include "circline/refine/track_frame.h"
#include "circline/refine/track_state.h"

namespace circline {

// Pose, probability, covariance, free directions, circles and directions of the map, in the memory
// that the hypothesis has; nothing that a frame says of it.
void FillHypothesis(const TrackMap& map, const TrackState& state, const Camera& camera,
                    PoseHypothesis* hypothesis);

// PoseEstimate::decided_by, of ranked hypotheses.
void DecidedByFrames(const std::vector<PoseHypothesis>& hypotheses, std::string* decided_by);

// What a frame says of a hypothesis: inliers, cost, what was left out and in words why.
// `distances`: memory.
void FillFrame(const TrackFrame& frame, const TrackFit& fit, PoseHypothesis* hypothesis,
               std::vector<std::string>* notes, std::vector<double>* distances);

}  // namespace circline

#endif  // CIRCLINE_REFINE_TRACK_RESULT_H_
