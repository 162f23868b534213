#include "apps/track/frame_observer.h"

#include <algorithm>
#include <cstddef>
#include <utility>

#include "apps/common/text.h"

namespace circline::apps {
namespace {

// A frame in which features are followed, rather than given anew.
bool IsFollowed(const TrackOptions& options, const SceneImage& image) {
  return image.detect_everything || options.compare.inputs.roi.has_value();
}

bool HasFit(const Observations& observations) {
  return std::any_of(observations.circles.begin(), observations.circles.end(),
                     [](const CircleObservation& circle) { return circle.fit.has_value(); });
}

}  // namespace

ImageRun FrameObserver::Observe(const PoseHypothesis* last, const PoseHypothesis* expected,
                                Frame* frame) {
  was_cold_ = was_cut_ = false;
  ImageRun run;
  run.image = &frame->image;
  run.read_error = frame->read_error;
  if (run.read_error.empty()) run.read_error = SettleCamera(frame).message;
  if (!run.read_error.empty()) return run;
  const bool looks_in_roi = options_.compare.inputs.roi && !has_given_;
  if (IsFollowed(options_, frame->image) && !looks_in_roi) return Follow(last, expected, frame);
  const Stopwatch watch;
  run = RunImage(options_.compare, nullptr, &frame->image, &frame->photo);
  was_cold_ = true;
  if (looks_in_roi && HasFit(run.observations)) {
    follower_.emplace(*camera_, options_.follow);
    follower_->Start(run.observations);
    has_given_ = true;
  }
  run.stages = {{"observe", watch.Microseconds()}};
  return run;
}

ImageRun FrameObserver::Follow(const PoseHypothesis* last, const PoseHypothesis* expected,
                               Frame* frame) {
  ImageRun run;
  run.image = &frame->image;
  run.photo = frame->photo;
  const Stopwatch watch;
  try {
    if (!follower_) {
      FollowOptions follow = options_.follow;
      follow.detection.noise_model.camera =
          CameraSigmaOf(options_.tracker.estimation, frame->image);
      follower_.emplace(*camera_, follow);
    }
    // After so long a gap the tracker begins anew, and nothing is where it was.
    if (frame->time_s - last_s_ > options_.tracker.max_gap_s && !has_given_) follower_->Reset();
    last_s_ = std::max(last_s_, frame->time_s);
    if (last != nullptr && expected != nullptr) follower_->Move(*last, expected->cam_from_world);
    const Status status = follower_->Next(frame->photo, &run.observations);
    if (!status.ok()) run.read_error = status.message;
  } catch (const std::exception& error) {  // Such as a frame too large for the memory.
    run.read_error = "cannot be worked on: " + Words(error);
  }
  run.stages.emplace_back("observe", watch.Microseconds());
  if (!run.read_error.empty()) return run;
  was_cold_ = follower_->was_cold();
  was_cut_ = follower_->was_cut();
  if (options_.compare.inputs.roi == std::nullopt) SetRadius(&run.observations);
  if (!run.observations.message.empty()) run.problems.push_back(run.observations.message);
  return run;
}

// One camera takes all frames, and all have the size of the first one.
Status FrameObserver::SettleCamera(Frame* frame) {
  Camera& camera = frame->image.observations.camera;
  if (!camera_) {
    if (!frame->photo.empty())
      SetGuessedCamera(options_.compare, frame->photo.size(), &frame->image);
    guessed_sigma_ = frame->image.guessed_sigma;
    camera_from_ = frame->image.camera_from;
    camera_ = camera;
    if (camera_->width == 0) camera_->width = frame->photo.cols;
    if (camera_->height == 0) camera_->height = frame->photo.rows;
  }
  const cv::Mat& photo = frame->photo;
  if (!photo.empty() && (photo.cols != camera_->width || photo.rows != camera_->height)) {
    return Status::Refused("the frame has " + std::to_string(photo.cols) + " x " +
                           std::to_string(photo.rows) + " pixels, the track " +
                           std::to_string(camera_->width) + " x " +
                           std::to_string(camera_->height));
  }
  camera = *camera_;
  frame->image.guessed_sigma = guessed_sigma_;
  frame->image.camera_from = camera_from_;
  return Status::Ok();
}

bool FrameObserver::SettleRadius(Observations* observations) {
  if (circle_of_radius_.empty() || FindCircle(*observations, circle_of_radius_) >= 0) return false;
  circle_of_radius_.clear();
  SetRadius(observations);
  return !circle_of_radius_.empty();
}

// The largest circle of the first frame of a world, then the same one wherever it is seen.
void FrameObserver::SetRadius(Observations* observations) {
  const double radius = options_.compare.inputs.circle_radius;
  if (!(radius > 0.0)) return;
  if (was_cut_) circle_of_radius_.clear();
  if (circle_of_radius_.empty()) {
    const int largest = SetLargestRadius(radius, observations);
    if (largest >= 0)
      circle_of_radius_ = observations->circles[static_cast<std::size_t>(largest)].id;
    return;
  }
  const int known = FindCircle(*observations, circle_of_radius_);
  if (known >= 0) observations->circles[static_cast<std::size_t>(known)].radius = radius;
}

}  // namespace circline::apps
