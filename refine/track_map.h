// From a frame's features to a tracker's map: the first frame, and features that turn up later.
// Internal: not installed.
#ifndef CIRCLINE_REFINE_TRACK_MAP_H_
#define CIRCLINE_REFINE_TRACK_MAP_H_

#include <vector>

#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/refine/pose_tracker.h"
#include "circline/refine/track_frame.h"

namespace circline {

// A map of the frame's circles and directions, and a wide Gaussian about each hypothesis with its
// probability. The first circle fixes origin and unit. `resolved`: fitted, with a world.
void StartMap(const Observations& resolved, const std::vector<PoseHypothesis>& hypotheses,
              const TrackerOptions& options, TrackMap* map, Kept<TrackFit>* states);

// Adds what the map does not have, where each hypothesis sees it, as not known yet.
void ExtendMap(const Observations& fitted, const TrackerOptions& options, TrackMap* map,
               Kept<TrackFit>* states);

}  // namespace circline

#endif  // CIRCLINE_REFINE_TRACK_MAP_H_
