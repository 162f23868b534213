// report.html of a track: how pose, probabilities and times go on over the frames.
#ifndef CIRCLINE_APPS_TRACK_TRACK_REPORT_H_
#define CIRCLINE_APPS_TRACK_TRACK_REPORT_H_

#include <string>
#include <vector>

#include "apps/track/track_run.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// Self-contained; pictures are taken from the overlays in the folder.
Status WriteTrackReport(const std::string& folder, const std::vector<TrackedFrame>& frames);

// Its plots over time, HTML: rotation, position, probabilities, standard deviation and error, NEES,
// times. One frame or more.
std::string TrackPlots(const std::vector<TrackedFrame>& frames);

// For stdout: how many frames were tracked, lost, predicted; times.
std::string TrackTable(const std::vector<TrackedFrame>& frames);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_TRACK_TRACK_REPORT_H_
