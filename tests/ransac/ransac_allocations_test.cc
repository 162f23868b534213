// The engine promises to allocate nothing after its set-up, whatever the model.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdlib>
#include <new>
#include <numeric>
#include <utility>
#include <vector>

#include "apps/benchmark/robust_fit_scenes.h"
#include "circline/ransac/conic_model.h"
#include "circline/ransac/line_model.h"
#include "circline/ransac/oriented_conic_model.h"
#include "circline/ransac/pencil_model.h"
#include "circline/ransac/ransac.h"
#include "tests/ransac/location_model.h"
#include "tests/ransac/segment_scene.h"

namespace {
// Allocations of the whole program.
std::atomic<int> allocations{0};

void* Allocate(std::size_t size) {
  ++allocations;
  void* p = std::malloc(size > 0 ? size : 1);
  if (p == nullptr) throw std::bad_alloc();
  return p;
}
// A call of its own: gcc takes a free() inlined where memory came from operator new for a mistake.
__attribute__((noinline)) void Release(void* p) { std::free(p); }
}  // namespace

void* operator new(std::size_t size) { return Allocate(size); }
void* operator new[](std::size_t size) { return Allocate(size); }
// The standard library's temporary buffers come from here.
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  ++allocations;
  return std::malloc(size > 0 ? size : 1);
}
void operator delete(void* p, const std::nothrow_t&) noexcept { Release(p); }
void operator delete(void* p) noexcept { Release(p); }
void operator delete[](void* p) noexcept { Release(p); }
void operator delete(void* p, std::size_t) noexcept { Release(p); }
void operator delete[](void* p, std::size_t) noexcept { Release(p); }

namespace circline {
namespace {

// Remembers how many there were when the engine's loop began.
class WatchedLocation : public Location {
 public:
  explicit WatchedLocation(Location location) : Location(std::move(location)) {}
  bool Fit(const int* sample, Value* value) const {
    if (fits_ == 0) allocations_at_first_fit_ = allocations;
    return Location::Fit(sample, value);
  }
  mutable int allocations_at_first_fit_ = 0;
};

TEST(Ransac, AllocatesNothingAfterSetUp) {
  const WatchedLocation model(MakeData(500, 100, 0.4));
  Ransac<WatchedLocation> engine{RansacOptions()};
  Ransac<WatchedLocation>::Report report;
  engine.Run(model, &report);
  EXPECT_GT(report.num_local_optimizations, 0);
  EXPECT_EQ(model.allocations_at_first_fit_, allocations);
  // Used again, it allocates nothing at all.
  const int before = allocations;
  engine.Run(model, &report);
  EXPECT_EQ(before, allocations);
}

template <typename Model>
void ExpectNoAllocations(const Model& model, double threshold) {
  RansacOptions options;
  options.threshold = threshold;
  options.max_iterations = 2000;
  Ransac<Model> engine(options);
  typename Ransac<Model>::Report report;
  engine.Run(model, &report);
  EXPECT_TRUE(report.success);
  EXPECT_GT(report.num_local_optimizations, 0);
  const int before = allocations;
  engine.Run(model, &report);
  EXPECT_EQ(before, allocations);
}

TEST(Ransac, TheModelsAllocateNothingInTheLoop) {
  const apps::ConicScene contour = apps::MakeConicScene({100, 0.5}, 1);
  const ConicModel conic(contour.points);
  const ConicModel oriented(contour.points, contour.directions);
  ExpectNoAllocations(conic, kInlierSigmas);
  ExpectNoAllocations(OrientedConicModel(oriented), kInlierSigmas);
  ExpectNoAllocations(LineModel(contour.points), kInlierSigmas);
  Random random(1);
  const std::vector<LineFit> lines =
      segment_scene::Lines(segment_scene::RandomRotation(&random).col(0), 40, 20, &random);
  std::vector<int> indices(lines.size());
  std::iota(indices.begin(), indices.end(), 0);
  ExpectNoAllocations(PencilModel(lines, indices, 0.0), kInlierSigmas);
}

}  // namespace
}  // namespace circline
