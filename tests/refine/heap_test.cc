// A long run keeps its memory.
#include <gtest/gtest.h>

#if defined(__GLIBC__)
#include <malloc.h>
#endif

#include <cstddef>

#include "circline/refine/estimate_pose.h"
#include "circline/refine/pose_tracker.h"
#include "tests/plane_scene.h"
#include "tests/trials.h"

namespace circline {
namespace {

#if defined(__GLIBC__) && (__GLIBC__ > 2 || __GLIBC_MINOR__ >= 33)

TEST(HeapTest, TenThousandCallsDoNotGrowIt) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer has a heap of its own";
  PlaneScene scene(0.7, 0.2);
  Observations observations = scene.Empty();
  observations.circles = {scene.Circle("c0", 0.5, 0.2, 1.0, 12)};
  EstimationOptions options;
  options.noise_model = NoiseModel::Exact();
  const auto run = [&](int calls) {
    for (int i = 0; i < calls; ++i) ASSERT_TRUE(EstimatePose(observations, options).status.ok());
  };
  run(1000);  // What libraries allocate once, and what stays in the caches of a thread.
  const std::size_t before = mallinfo2().uordblks;
  constexpr int kCalls = 10000;
  run(kCalls);
  const std::size_t after = mallinfo2().uordblks;
  // Less than a byte a call.
  EXPECT_LT(after, before + kCalls);
}

TEST(HeapTest, ATrackDoesNotGrowIt) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer has a heap of its own";
  PlaneScene scene(0.7, 0.2);
  Observations observations = scene.Empty();
  observations.circles = {scene.Circle("c0", 0.5, 0.2, 1.0, 12)};
  TrackerOptions options;
  options.estimation.noise_model = NoiseModel::Exact();
  PoseTracker tracker(options);
  double time = 0.0;
  const auto run = [&](int frames) {
    for (int i = 0; i < frames; ++i) {
      time += 0.03;
      ASSERT_TRUE(tracker.Update(observations, time).estimate.status.ok());
    }
  };
  run(1000);  // Some kilobytes stay in the allocator's caches of a thread, once.
  const std::size_t before = mallinfo2().uordblks;
  // CIRCLINE_TRACK_FRAMES=100000: a long run.
  const int frames = Trials("CIRCLINE_TRACK_FRAMES", 1000);
  run(frames);
  EXPECT_LT(mallinfo2().uordblks, before + static_cast<std::size_t>(frames));
}

#endif

}  // namespace
}  // namespace circline
