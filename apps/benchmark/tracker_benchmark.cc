// What a frame costs a tracker: for each hypothesis carried, and at worst of many frames.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <vector>

#include "apps/benchmark/trajectory.h"
#include "circline/refine/pose_tracker.h"

namespace circline {
namespace {

constexpr std::size_t kFrames = 1000;

// A circle of 100 points and, with `lines`, four lines of 30; `lines` also decide between the
// circle's two poses.
struct Sequence {
  Sequence(bool lines, bool fitted) {
    TrajectoryOptions options;
    options.pencil = lines;
    options.occluded = 0.0;
    options.noise_px = 0.5;
    const Trajectory trajectory(options, 1);
    Random noise(2);
    for (const Trajectory::Frame& frame : trajectory.frames) {
      frames.push_back(trajectory.Observe(frame, &noise));
      if (fitted) FitDirect(options.noise_px, &frames.back());
    }
    // There and back, so that it goes on for ever.
    for (std::size_t k = frames.size() - 1; k-- > 1;) frames.push_back(frames[k]);
    fps = options.fps;
  }

  const Observations& Frame(std::size_t k) const { return frames[k % frames.size()]; }

  std::vector<Observations> frames;
  double fps = 30.0;
};

void BM_TrackerUpdate(benchmark::State& state, bool lines, bool fitted) {
  const Sequence sequence(lines, fitted);
  PoseTracker tracker;
  std::size_t k = 0;
  double hypotheses = 0.0;
  for (auto _ : state) {
    const TrackedPose tracked =
        tracker.Update(sequence.Frame(k), static_cast<double>(k) / sequence.fps);
    ++k;
    hypotheses += static_cast<double>(tracked.estimate.hypotheses.size());
    benchmark::DoNotOptimize(tracked);
  }
  state.counters["hypotheses"] = hypotheses / static_cast<double>(k);
  // Seconds a hypothesis.
  state.counters["each"] =
      benchmark::Counter(hypotheses, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}
BENCHMARK_CAPTURE(BM_TrackerUpdate, circle_and_lines_fitted, true, true);
BENCHMARK_CAPTURE(BM_TrackerUpdate, circle_and_lines, true, false);
BENCHMARK_CAPTURE(BM_TrackerUpdate, one_circle_fitted, false, true);
BENCHMARK_CAPTURE(BM_TrackerUpdate, one_circle, false, false);

// Times of single frames of one loop: the middle one, the 99th percentile and the worst,
// milliseconds.
void BM_TrackerLatency(benchmark::State& state) {
  const Sequence sequence(true, false);
  std::vector<double> milliseconds;
  for (auto _ : state) {
    PoseTracker tracker;
    milliseconds.clear();
    for (std::size_t k = 0; k < kFrames; ++k) {
      const auto begin = std::chrono::steady_clock::now();
      benchmark::DoNotOptimize(
          tracker.Update(sequence.Frame(k), static_cast<double>(k) / sequence.fps));
      const std::chrono::duration<double, std::milli> took =
          std::chrono::steady_clock::now() - begin;
      milliseconds.push_back(took.count());
    }
  }
  std::sort(milliseconds.begin(), milliseconds.end());
  state.counters["p50_ms"] = milliseconds[kFrames / 2];
  state.counters["p99_ms"] = milliseconds[kFrames * 99 / 100];
  state.counters["p100_ms"] = milliseconds.back();
}
// By thread, each with a tracker of its own.
BENCHMARK(BM_TrackerLatency)->Unit(benchmark::kMillisecond)->Threads(1)->Threads(2)->Threads(8);

}  // namespace
}  // namespace circline
