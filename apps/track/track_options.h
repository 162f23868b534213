// What circline_track was asked to do.
#ifndef CIRCLINE_APPS_TRACK_TRACK_OPTIONS_H_
#define CIRCLINE_APPS_TRACK_TRACK_OPTIONS_H_

#include <string>

#include "apps/compare/options.h"
#include "circline/estimators/status.h"
#include "circline/ransac/detection/feature_follower.h"
#include "circline/refine/pose_tracker.h"

namespace circline::apps {

struct TrackOptions {
  CompareOptions compare;  // Inputs, detection, fits, losses (the first one), output.
  FollowOptions follow;
  TrackerOptions tracker;
  std::string video;       // Not empty: instead of photos.
  std::string video_out;   // Name of the video of overlays in the output folder; empty = none.
  std::string timestamps;  // A file; empty = by fps.
  double fps = 0.0;        // 0 = that of the video, or 25.
};

// Not ok: one line that names the flag. Reads nothing but the file of --noise_model.
Status TrackOptionsFromFlags(TrackOptions* options);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_TRACK_TRACK_OPTIONS_H_
