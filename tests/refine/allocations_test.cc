// What a cost function allocates, and a tracker once it runs: nothing but what ceres does.
#include <gtest/gtest.h>

#include "tests/trials.h"

#if defined(__GLIBC__) && !defined(CIRCLINE_SANITIZED)

#include <dlfcn.h>
#include <elf.h>
#include <execinfo.h>
#include <link.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "apps/benchmark/trajectory.h"
#include "circline/refine/cost_functions.h"
#include "circline/refine/pose_tracker.h"
#include "tests/plane_scene.h"

namespace circline {
namespace {

// A function of ceres or of this library, in memory.
struct Function {
  std::uintptr_t begin, end;
  bool is_ours;
};
std::vector<Function> functions;  // In order.

template <typename T>
const T* At(const std::string& file, std::size_t offset) {
  return reinterpret_cast<const T*>(file.data() + offset);
}

bool StartsWith(const char* text, const char* start) {
  return std::strncmp(text, start, std::strlen(start)) == 0;
}

// Those of a program or a shared library, by the symbols of its file.
int FindFunctions(dl_phdr_info* info, std::size_t /*size*/, void* /*data*/) {
  const bool is_program = info->dlpi_name[0] == 0;
  std::ifstream in(is_program ? "/proc/self/exe" : info->dlpi_name, std::ios::binary);
  const std::string file((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  if (file.size() < sizeof(ElfW(Ehdr)) || file.compare(0, SELFMAG, ELFMAG) != 0) return 0;
  const auto* elf = At<ElfW(Ehdr)>(file, 0);
  const auto* sections = At<ElfW(Shdr)>(file, elf->e_shoff);
  for (int i = 0; i < elf->e_shnum; ++i) {
    if (sections[i].sh_type != SHT_SYMTAB && sections[i].sh_type != SHT_DYNSYM) continue;
    const char* names = At<char>(file, sections[sections[i].sh_link].sh_offset);
    const auto* symbols = At<ElfW(Sym)>(file, sections[i].sh_offset);
    for (std::size_t k = 0; k < sections[i].sh_size / sizeof(ElfW(Sym)); ++k) {
      const char* name = names + symbols[k].st_name;
      const bool is_ours = StartsWith(name, "_ZN8circline") || StartsWith(name, "_ZNK8circline");
      const bool is_of_ceres = StartsWith(name, "_ZN5ceres") || StartsWith(name, "_ZNK5ceres");
      if (symbols[k].st_size == 0 || (!is_ours && !is_of_ceres)) continue;
      const auto begin = static_cast<std::uintptr_t>(info->dlpi_addr + symbols[k].st_value);
      functions.push_back({begin, begin + symbols[k].st_size, is_ours});
    }
  }
  return 0;
}

// Null: neither ceres's nor ours.
const Function* FunctionAt(const void* address) {
  const auto at = reinterpret_cast<std::uintptr_t>(address);
  const auto after =
      std::upper_bound(functions.begin(), functions.end(), at,
                       [](std::uintptr_t value, const Function& f) { return value < f.begin; });
  return after != functions.begin() && at < std::prev(after)->end ? &*std::prev(after) : nullptr;
}

constexpr int kMaxFrames = 48, kMaxSites = 4096;
struct Site {
  void* frames[kMaxFrames];
  int num_frames;
};
struct Counts {
  long ours = 0, of_ceres = 0;
  Site sites[kMaxSites];  // The first ones of ours.
};
Counts counts;
thread_local bool is_counting = false;

constexpr int kHooks = 2;  // Frames of those below.

// An allocation is of whose function is on the way to it last: a residual that ceres evaluates is
// ours.
__attribute__((noinline)) void Count() {
  if (!is_counting) return;
  is_counting = false;
  Site site;
  site.num_frames = backtrace(site.frames, kMaxFrames);
  const Function* by = nullptr;
  for (int k = kHooks; k < site.num_frames && by == nullptr; ++k) by = FunctionAt(site.frames[k]);
  if (by != nullptr && !by->is_ours) {
    ++counts.of_ceres;
  } else {
    if (counts.ours < kMaxSites) counts.sites[counts.ours] = site;
    ++counts.ours;
  }
  is_counting = true;
}

// CIRCLINE_ALLOCATIONS=1: says who allocates, for addr2line.
void PrintSites() {
  if (std::getenv("CIRCLINE_ALLOCATIONS") == nullptr) return;
  for (long i = 0; i < std::min<long>(counts.ours, kMaxSites); ++i) {
    std::fprintf(stderr, "site");
    for (int k = kHooks; k < counts.sites[i].num_frames; ++k) {
      Dl_info info;
      if (dladdr(counts.sites[i].frames[k], &info) == 0) continue;
      const auto offset =
          static_cast<char*>(counts.sites[i].frames[k]) - static_cast<char*>(info.dli_fbase);
      std::fprintf(stderr, " %s+0x%tx", info.dli_fname, offset - 1);
    }
    std::fprintf(stderr, "\n");
  }
}

}  // namespace
}  // namespace circline

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);

void* malloc(std::size_t size) noexcept {
  circline::Count();
  return __libc_malloc(size);
}
void* calloc(std::size_t number, std::size_t size) noexcept {
  circline::Count();
  return __libc_calloc(number, size);
}
void* realloc(void* p, std::size_t size) noexcept {
  circline::Count();
  return __libc_realloc(p, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  circline::Count();
  return __libc_memalign(alignment, size);
}
int posix_memalign(void** p, std::size_t alignment, std::size_t size) noexcept {
  circline::Count();
  *p = __libc_memalign(alignment, size);
  return *p != nullptr ? 0 : ENOMEM;
}
}

namespace circline {
namespace {

// Reads the symbols; false where programs have none.
bool FindAllFunctions() {
  if (functions.empty()) {
    dl_iterate_phdr(FindFunctions, nullptr);
    std::sort(functions.begin(), functions.end(),
              [](const Function& a, const Function& b) { return a.begin < b.begin; });
  }
  void* warm[kMaxFrames];
  backtrace(warm, kMaxFrames);  // Allocates at its first call.
  return !functions.empty();
}

TEST(CostFunctionAllocations, NoneInAnEvaluation) {
  if (!FindAllFunctions()) GTEST_SKIP() << "programs have no symbols";
  PlaneScene scene(0.7, 0.1);
  const std::vector<Eigen::Vector2d> circle = scene.Circle("c", 0.0, 0.0, 1.0).points;
  const std::vector<Eigen::Vector2d> line =
      scene.Line({-1.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, 30).points;
  const auto points = [&](const auto& pixels) { return ImagePoints(scene.camera, pixels, {}, {}); };
  PlaneCircleContourCost::Blocks with;
  with.tilt_and_height = with.shape = with.offset = with.camera = true;
  with.tilt_sigmas = {0.01, 0.01, 0.01};
  const PlaneCircleContourCost of_circle(points(circle), with);
  const PlaneLineCost of_plane(points(line), true);
  LineFit fit;
  ASSERT_TRUE(FitLine(points(line).points(), 1.0, &fit).ok());
  const DirectionLineCost of_direction(points(line), fit.line, {0.01, true});
  const Eigen::Quaterniond q(scene.pose.rotation);
  const double *rotation = q.coeffs().data(), *translation = scene.pose.translation.data();
  const double zeros[kCameraSize] = {}, radius = 1.0, x[3] = {1.0, 0.0, 0.0};
  const std::vector<std::pair<const FeatureCost*, std::vector<const double*>>> all = {
      {&of_circle, {rotation, translation, zeros, &radius, zeros, zeros, zeros, zeros}},
      {&of_plane, {rotation, translation, zeros, zeros, zeros}},
      {&of_direction, {rotation, x, zeros, zeros}}};
  std::vector<double> residuals(32), room(8 * 32 * kCameraSize);
  std::vector<double*> jacobians;
  for (std::size_t k = 0; k < 8; ++k) jacobians.push_back(&room[k * 32 * kCameraSize]);
  for (const auto& [cost, parameters] : all) {
    counts.ours = counts.of_ceres = 0;
    is_counting = true;
    const bool ok = cost->Evaluate(parameters.data(), residuals.data(), jacobians.data());
    is_counting = false;
    PrintSites();
    EXPECT_TRUE(ok);
    EXPECT_EQ(counts.ours + counts.of_ceres, 0);
  }
}

struct Case {
  const char* name;
  bool pencil, second_circle, fitted, exact, knows_motion;
};

class AllocationsTest : public testing::TestWithParam<Case> {};

TEST_P(AllocationsTest, NoneOfOursInSteadyState) {
  if (!FindAllFunctions()) GTEST_SKIP() << "programs have no symbols";
  TrajectoryOptions trajectory;
  trajectory.pencil = GetParam().pencil;
  trajectory.second_circle = GetParam().second_circle;
  trajectory.occluded = 0.0;
  trajectory.noise_px = 0.5;
  const Trajectory sequence(trajectory, 1);
  TrackerOptions options;
  if (GetParam().exact) options = ExactOptions(trajectory);
  Random noise(1);
  std::vector<Observations> frames;
  for (const Trajectory::Frame& frame : sequence.frames) {
    frames.push_back(sequence.Observe(frame, &noise));
    frames.back().camera.id = "a camera with a long name";
    if (GetParam().fitted) FitDirect(trajectory.noise_px, &frames.back());
  }
  PoseTracker tracker(options);
  TrackedPose tracked;
  const std::size_t first_counted = frames.size() / 2;
  counts.ours = counts.of_ceres = 0;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    MotionPrior motion;
    if (GetParam().knows_motion && k > 0) {
      const CameraPose& pose = sequence.frames[k].pose;
      motion = Gyroscope(sequence.frames[k - 1].pose, pose);
      motion.gravity = GravityPrior{Eigen::Vector3d::UnitZ(), pose.rotation.col(2), 0.01};
      motion.absolute.emplace();
      motion.absolute->mean = pose;
      for (std::size_t i = 0; i < 6; ++i) motion.absolute->covariance[7 * i] = 1.0;
    }
    is_counting = k >= first_counted;
    tracker.Update(frames[k], static_cast<double>(k) / trajectory.fps, motion, &tracked);
    is_counting = false;
    ASSERT_TRUE(tracked.estimate.status.ok());
  }
  PrintSites();
  EXPECT_EQ(counts.ours, 0);
  EXPECT_GT(counts.of_ceres, 0);  // Those of ceres are counted, too: else nothing was.
}

INSTANTIATE_TEST_SUITE_P(PoseTracker, AllocationsTest,
                         testing::Values(Case{"circle", false, false, true, true, false},
                                         Case{"circle_and_lines", true, false, true, true, false},
                                         Case{"known_motion", true, false, true, true, true},
                                         Case{"as_measured", true, true, true, false, false},
                                         Case{"not_fitted", true, true, false, false, false}),
                         [](const auto& one) { return one.param.name; });

}  // namespace
}  // namespace circline

#endif  // Of glibc, without a sanitizer.
