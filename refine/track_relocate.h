// Back to a known map after a loss. Internal: not installed.
#ifndef CIRCLINE_REFINE_TRACK_RELOCATE_H_
#define CIRCLINE_REFINE_TRACK_RELOCATE_H_

#include <vector>

#include "circline/estimators/pose.h"
#include "circline/refine/pose_tracker.h"
#include "circline/refine/track_frame.h"

namespace circline {

// The states of a map where a single frame, of a world of its own, sees its circles: pose and
// velocities as not known, landmarks and camera as they are. Circles and directions are the same
// where their ids are. Empty where no circle of the map is seen.
std::vector<TrackState> Relocated(const TrackMap& map, const Kept<TrackFit>& states,
                                  const std::vector<PoseHypothesis>& seen,
                                  const TrackerOptions& options);

}  // namespace circline

#endif  // CIRCLINE_REFINE_TRACK_RELOCATE_H_
