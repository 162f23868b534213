#include "apps/track/track_options.h"

#include <gflags/gflags.h>

#include <cmath>
#include <filesystem>

DECLARE_string(images);
DECLARE_string(scene);

DEFINE_string(video, "", "Instead of --images or --scene: a video file, any that FFmpeg reads.");
DEFINE_double(fps, 0.0, "Frames per second; 0 = as the video says, 25 for photos.");
DEFINE_string(timestamps, "",
              "A file with the seconds of every frame, one a line, where they are not evenly "
              "spaced.");
DEFINE_string(video_out, "",
              "Also write the overlays as a video of this name into --output: name.mp4 or "
              "name.avi.");
DEFINE_double(search_px, circline::FollowOptions().search_px,
              "How far from where it is expected a feature is looked for, pixels.");
DEFINE_int32(cold_every, circline::FollowOptions().cold_every,
             "Every so many frames the whole frame is looked at for new features; 1 = always, 0 = "
             "only where too little is found.");
DEFINE_double(turn_rate_sigma, circline::TrackerOptions().turn_rate_sigma,
              "How far the turn of the camera changes within a second, rad/s.");
DEFINE_double(velocity_sigma, circline::TrackerOptions().velocity_sigma,
              "How far its velocity changes within a second, distances (to the world's origin) per "
              "second.");
DEFINE_int32(lost_after, circline::TrackerOptions().lost_after,
             "Frames in a row that contradict the track before it starts anew.");

namespace circline::apps {
namespace {

Status CheckSource() {
  if (FLAGS_video.empty()) return Status::Ok();
  if (!FLAGS_images.empty() || !FLAGS_scene.empty())
    return Status::Invalid("give one of --video, --images and --scene");
  FLAGS_images = FLAGS_video;  // Camera and regions of interest are said of it as of photos.
  return Status::Ok();
}

Status CheckVideoOut(const TrackOptions& options) {
  const std::string& name = options.video_out;
  if (name.empty()) return Status::Ok();
  const std::filesystem::path extension = std::filesystem::path(name).extension();
  if (name.find('/') != std::string::npos || (extension != ".mp4" && extension != ".avi"))
    return Status::Invalid("--video_out=" + name + ": must be a name that ends in .mp4 or .avi");
  if (!options.compare.overlays)
    return Status::Invalid("--video_out needs the overlays: not with --overlays=false");
  return Status::Ok();
}

}  // namespace

Status TrackOptionsFromFlags(TrackOptions* options) {
  Status status = CheckSource();
  if (status.ok()) status = OptionsFromFlags(&options->compare);
  if (status.ok()) status = CheckOneLoss(options->compare);
  if (!status.ok()) return status;
  options->video = FLAGS_video;
  options->video_out = FLAGS_video_out;
  options->timestamps = FLAGS_timestamps;
  options->fps = FLAGS_fps;
  if (!(FLAGS_fps >= 0.0) || !std::isfinite(FLAGS_fps))
    return Status::Invalid("--fps must be positive");
  options->follow.detection = options->compare.detection;
  options->follow.search_px = FLAGS_search_px;
  options->follow.cold_every = FLAGS_cold_every;
  status = options->follow.Validate();
  if (!status.ok()) return Status::Invalid("--" + status.message);
  TrackerOptions& tracker = options->tracker;
  tracker.estimation = options->compare.losses.front().estimation;
  tracker.turn_rate_sigma = FLAGS_turn_rate_sigma;
  tracker.velocity_sigma = FLAGS_velocity_sigma;
  tracker.lost_after = FLAGS_lost_after;
  status = tracker.Validate();
  if (!status.ok()) return Status::Invalid("--" + status.message);
  return CheckVideoOut(*options);
}

}  // namespace circline::apps
