// What is seen in the frames of a track: annotated, given once and followed, or all detected.
#ifndef CIRCLINE_APPS_TRACK_FRAME_OBSERVER_H_
#define CIRCLINE_APPS_TRACK_FRAME_OBSERVER_H_

#include <limits>
#include <optional>
#include <string>

#include "apps/compare/image_run.h"
#include "apps/track/frame_source.h"
#include "apps/track/track_options.h"
#include "circline/estimators/pose.h"

namespace circline::apps {

class FrameObserver {
 public:
  // `options` outlives the observer.
  explicit FrameObserver(const TrackOptions& options) : options_(options) {}

  // The frame outlives the run, which has no pose yet. A frame that cannot be used has a
  // read_error. `last` and `expected` are the pose of the frame before and the one expected for
  // this one, in one world and unit; either may be absent.
  ImageRun Observe(const PoseHypothesis* last, const PoseHypothesis* expected, Frame* frame);

  // The circle that --circle_radius speaks of, in a frame that begins a world without it: the
  // largest one there is. False where none had to be, or can be, chosen.
  bool SettleRadius(Observations* observations);

  bool was_cold() const { return was_cold_; }  // The whole frame was looked at.
  bool was_cut() const { return was_cut_; }    // Nothing of the frames before was found in it.

 private:
  ImageRun Follow(const PoseHypothesis* last, const PoseHypothesis* expected, Frame* frame);
  Status SettleCamera(Frame* frame);
  void SetRadius(Observations* observations);

  const TrackOptions& options_;
  std::optional<Camera> camera_;              // Of all frames, since the first one.
  std::optional<CameraSigma> guessed_sigma_;  // Of the same, where it is a guess.
  std::string camera_from_;                   // SceneImage::camera_from.
  std::optional<FeatureFollower> follower_;
  bool has_given_ = false;        // The circle in --roi was found and is followed.
  std::string circle_of_radius_;  // Id of the one that --circle_radius speaks of.
  bool was_cold_ = false, was_cut_ = false;
  // Of the last frame that was looked at.
  double last_s_ = -std::numeric_limits<double>::infinity();
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_TRACK_FRAME_OBSERVER_H_
