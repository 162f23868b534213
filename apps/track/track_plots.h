// How a track goes on over time, as plots.
#ifndef CIRCLINE_APPS_TRACK_TRACK_PLOTS_H_
#define CIRCLINE_APPS_TRACK_TRACK_PLOTS_H_

#include <string>
#include <vector>

#include "apps/track/track_run.h"

namespace circline::apps {

// HTML: rotation, position, probabilities, standard deviation and error, NEES, times. One frame or
// more.
std::string TrackPlots(const std::vector<TrackedFrame>& frames);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_TRACK_TRACK_PLOTS_H_
