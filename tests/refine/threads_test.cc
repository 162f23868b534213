// Many estimates and tracks at once: the bits of one thread, and, where it is long, memory and
// descriptors as they were. CIRCLINE_SOAK_CALLS=1000000: a long run.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <thread>
#include <vector>

#include "circline/refine/estimate_pose.h"
#include "circline/refine/pose_tracker.h"
#include "tests/plane_scene.h"
#include "tests/trials.h"

namespace circline {
namespace {

constexpr int kThreads = 4;

std::vector<Observations> Photos() {
  PlaneScene scene(0.7, 0.2);
  std::vector<Observations> photos(3, scene.Empty());
  photos[0].circles = {scene.Circle("c0", 0.5, 0.2, 1.0, 12)};
  photos[1] = photos[0];
  photos[1].pencils = {scene.Pencil("x", PencilDirection::kX, {1.0, 0.0, 0.0}, 2)};
  photos[2].pencils = {scene.Pencil("x", PencilDirection::kX, {1.0, 0.0, 0.0}, 2),
                       scene.Pencil("y", PencilDirection::kY, {0.0, 1.0, 0.0}, 2)};
  return photos;
}

void ExpectSame(const PoseEstimate& expected, const PoseEstimate& actual) {
  ASSERT_EQ(actual.hypotheses.size(), expected.hypotheses.size());
  for (std::size_t i = 0; i < expected.hypotheses.size(); ++i) {
    const PoseHypothesis &a = expected.hypotheses[i], &b = actual.hypotheses[i];
    ASSERT_EQ(b.cam_from_world.rotation, a.cam_from_world.rotation);
    ASSERT_EQ(b.cam_from_world.translation, a.cam_from_world.translation);
    ASSERT_EQ(b.probability, a.probability);
    ASSERT_EQ(b.Covariance(), a.Covariance());
  }
}

// Kilobytes that this process has in memory.
std::size_t ResidentKilobytes() {
  std::ifstream file("/proc/self/statm");
  std::size_t total = 0, resident_pages = 0;
  file >> total >> resident_pages;
  constexpr std::size_t kPageKilobytes = 4;
  return kPageKilobytes * resident_pages;
}

std::size_t NumDescriptors() {
  const std::filesystem::directory_iterator begin("/proc/self/fd");
  return static_cast<std::size_t>(std::distance(begin, std::filesystem::directory_iterator()));
}

// What the calls of one thread must answer, made by one thread alone.
struct Expected {
  std::vector<Observations> photos = Photos();
  std::vector<PoseEstimate> estimates;
  std::vector<TrackedPose> track;  // Of the photos over and over.

  Expected() {
    for (const Observations& photo : photos) estimates.push_back(EstimatePose(photo));
    PoseTracker tracker;
    for (int frame = 0; frame < 30; ++frame) track.push_back(Update(frame, &tracker));
  }
  TrackedPose Update(int frame, PoseTracker* tracker) const {
    return tracker->Update(photos[static_cast<std::size_t>(frame) % photos.size()], 0.03 * frame);
  }
};

// Half of the calls are estimates, the others frames of a track that begins again.
void Call(const Expected& expected, int calls) {
  const int frames = static_cast<int>(expected.track.size());
  PoseTracker tracker;
  for (int i = 0; i < calls / 2; ++i) {
    const std::size_t photo = static_cast<std::size_t>(i) % expected.photos.size();
    ExpectSame(expected.estimates[photo], EstimatePose(expected.photos[photo]));
    const int frame = i % frames;
    if (frame == 0) tracker = PoseTracker();
    ExpectSame(expected.track[static_cast<std::size_t>(frame)].estimate,
               expected.Update(frame, &tracker).estimate);
    if (testing::Test::HasFailure()) return;
  }
}

void CallInThreads(const Expected& expected, int calls) {
  std::vector<std::thread> threads;
  for (int i = 0; i < kThreads; ++i)
    threads.emplace_back([&] { Call(expected, calls / kThreads); });
  for (std::thread& thread : threads) thread.join();
}

TEST(Threads, EstimatesAndTracksAtOnceAreThoseOfOneThread) {
  const Expected expected;
  const int calls = Trials("CIRCLINE_SOAK_CALLS", 2000);
  CallInThreads(expected, std::max(calls / 10, 2 * kThreads));
  const std::size_t kilobytes = ResidentKilobytes(), descriptors = NumDescriptors();
  CallInThreads(expected, calls);
  RecordProperty("kilobytes_after_a_tenth", std::to_string(kilobytes));
  RecordProperty("kilobytes_at_the_end", std::to_string(ResidentKilobytes()));
  EXPECT_EQ(NumDescriptors(), descriptors);
  if (kSanitized) return;                // Sanitizers keep freed memory.
  constexpr std::size_t kArenas = 4096;  // Kilobytes that the heaps of new threads may differ by.
  EXPECT_LE(ResidentKilobytes(), kilobytes + kArenas);
}

}  // namespace
}  // namespace circline
