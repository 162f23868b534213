// Circles and parallel lines of a video, from frame to frame.
//
//     FeatureFollower follower(camera, FollowOptions());
//     while (Read(&image)) {
//       Observations observations;
//       const Status status = follower.Next(image, &observations);
//       ... estimate or track the pose ...
//       follower.Move(hypothesis, predicted_pose);  // Optional: where the next frame is looked at.
//     }
//
// The first frame is detected cold (DetectObservations). In the next ones edges are looked for only
// in bands about the predicted features: the same edges, the same fits, the same noise as cold, in
// a fraction of the time. A feature keeps its id; one that is not found stays expected until the
// whole photo is looked at, and the ids of what is lost then are not used again. The whole photo is
// looked at anew, and what is found is named after the features that it continues,
// - every `cold_every` frames, for new features,
// - in every frame while what is expected has no pose: no circle, and less than two pencils, and
// - where less than `min_found_share` of the circles, or of all features, that were there at the
//   last look are found.
#ifndef CIRCLINE_RANSAC_DETECTION_FEATURE_FOLLOWER_H_
#define CIRCLINE_RANSAC_DETECTION_FEATURE_FOLLOWER_H_

#include <opencv2/core.hpp>

#include "circline/estimators/export.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/status.h"
#include "circline/ransac/detection/detect_observations.h"

namespace CIRCLINE_EXPORT circline {

// How features are followed.
struct FollowOptions {
  DetectionOptions detection;  // As for a single photo.
  // How far from its prediction a feature is looked for, pixels; in [3, 200]. More follows faster
  // turns, and takes longer. As much again for every frame in a row with too little in it.
  double search_px = 12.0;
  // Circles and lines; in [0, 1].
  double min_found_share = 0.5;
  // Frames; 1 = every frame is detected cold, 0 = only where too little is found.
  int cold_every = 30;

  // Ok, or a sentence that names the field which is wrong.
  Status Validate() const;
};

// Numbers of the next new "c0", "L0", "p0", and what the world has had so far.
struct NextNames {
  int circle = 0, pencil = 0, plane = 0;  // Counted up, never down.
  bool has_axes = false;                  // Whether x and y are taken.
  bool has_circles = false;               // In its plane.
};

// Not thread-safe; several of them are, on different threads.
class FeatureFollower {
 public:
  // Nothing is followed yet.
  FeatureFollower(const Camera& camera, const FollowOptions& options);

  // The features of the next frame, fits included. Not ok as DetectObservations: then nothing was
  // looked at and the follower stays where it was.
  Status Next(const cv::Mat& image, Observations* observations);

  // Follows these features (fitted, of the last frame) and looks for no others; ids and structure
  // are theirs. What the frame beside them states in pixels (centres, axes, lengths) is not
  // followed.
  void Start(const Observations& given);

  // Where what is held is expected in the next frame, from a pose of the last frame and the one
  // expected for the next, both in the same world and unit. Circles move with their own planes,
  // lines with the world's, others as if at its origin.
  void Move(const PoseHypothesis& last, const CameraPose& next);

  // Forgets everything but the ids that were used.
  void Reset();

  // Of the last frame: whether the whole photo was looked at, and whether what was found there is
  // another scene than before: the first frame, a cut. A frame with much less in it than before,
  // and none of that, counts as blurred or covered (no features), the third in a row as a cut.
  // What was given is never cut off.
  bool was_cold() const { return was_cold_; }
  bool was_cut() const { return was_cut_; }

 private:
  Status Cold(const cv::Mat& image, Observations* found, Observations* expect);
  bool IsTimeForCold() const;
  bool HasEnough(const Observations& found) const;
  double SearchPx() const;

  Observations nothing_;  // Through the camera, as the frame that settled it has it.
  bool is_settled_ = false;
  FollowOptions options_;
  Observations held_;  // Where the features are expected.
  bool is_given_ = false, was_cold_ = false, was_cut_ = false;
  int num_at_look_ = 0, num_circles_at_look_ = 0;  // Features at the last cold look.
  int frames_since_cold_ = 0, frames_lost_ = 0;
  NextNames next_;
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_FEATURE_FOLLOWER_H_
