// The whole track: frames through the tracker into files.
#ifndef CIRCLINE_APPS_TRACK_TRACK_RUN_H_
#define CIRCLINE_APPS_TRACK_TRACK_RUN_H_

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "apps/track/frame_source.h"
#include "apps/track/track_options.h"
#include "circline/estimators/status.h"

namespace circline::apps {

// What is kept of a frame for the report.
struct TrackedFrame {
  std::string name, overlay;  // The picture relative to the output folder; empty if there is none.
  std::string error;          // Not empty: the frame could not be used, and why.
  std::string message;        // What the tracker says of it.
  double time_s = 0.0;
  bool has_pose = false, reinitialized = false, predicted_only = false, cold = false;
  // Of the hypotheses, best first.
  std::vector<double> probabilities;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  // Of the best, cam_from_world.
  Eigen::Vector3d center = Eigen::Vector3d::Zero();        // Of the camera, in the world.
  std::optional<double> sigma_deg;                         // Of its normal.
  std::optional<double> error_deg;                         // PoseErrors::Headline.
  std::optional<double> nees;                              // By the degrees of freedom.
  double observe_us = 0.0, track_us = 0.0;
};

// Writes results.jsonl, observations.jsonl and timings.jsonl frame by frame, overlays, and
// trajectory.txt at the end. Not ok: a folder or file that cannot be written.
Status RunTrack(const TrackOptions& options, FrameSource* source,
                std::vector<TrackedFrame>* frames);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_TRACK_TRACK_RUN_H_
