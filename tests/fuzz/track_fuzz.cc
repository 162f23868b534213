// PoseTracker over frames of any evidence, of which some are one frame that is slightly moved.
#include "circline/refine/pose_tracker.h"
#include "tests/fuzz/fuzz.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace circline;
  fuzz::Bytes bytes(data, size);
  TrackerOptions options;
  options.max_evaluations = 1 + bytes.Below(20);
  options.lost_after = 1 + bytes.Below(4);
  PoseTracker tracker(options);
  Observations observations = fuzz::ArbitraryObservations(&bytes);
  double seconds = 0.0;
  for (int frame = 0; frame < 5; ++frame) {
    MotionPrior motion;
    if (bytes.OneIn(8)) {
      RelativePose& relative = motion.relative.emplace();
      relative.now_from_before.translation.x() += bytes.Number(-0.1, 0.1);
      for (int i = 0; i < 6; ++i) relative.covariance[static_cast<std::size_t>(7 * i)] = 1e-2;
    }
    const TrackedPose tracked = tracker.Update(observations, seconds, motion);
    fuzz::ExpectSound(tracked.estimate);
    fuzz::Expect(tracked.frames_since_start >= 0, "frames are counted");
    seconds += bytes.Number(-0.02, 0.5);
    if (bytes.OneIn(3)) observations = fuzz::ArbitraryObservations(&bytes);
    for (CircleObservation& circle : observations.circles) {
      for (Eigen::Vector2d& point : circle.points) point.x() += bytes.Between(-1.0, 1.0);
    }
  }
  return 0;
}
