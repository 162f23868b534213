// The hypotheses of a tracker against one another: which are one, how probable each is, in which
// order. Internal: not installed.
#ifndef CIRCLINE_REFINE_TRACK_RANKING_H_
#define CIRCLINE_REFINE_TRACK_RANKING_H_

#include "circline/refine/pose_tracker.h"
#include "circline/refine/scratch.h"
#include "circline/refine/track_frame.h"
#include "circline/refine/track_state.h"

namespace circline {

// Minima that several starts lead to are one, its weight the larger one of two starts of a
// hypothesis, or the sum of the probabilities of two hypotheses.
enum class MergedWeight { kLarger, kSum };
void Merge(const TrackMap& map, MergedWeight weight, Kept<TrackFit>* fits);

// Log weights to log probabilities; drops what is improbable and orders the rest. The first stays
// first unless another one is clearly more probable.
void Rank(const TrackerOptions& options, Kept<TrackFit>* fits);

}  // namespace circline

#endif  // CIRCLINE_REFINE_TRACK_RANKING_H_
