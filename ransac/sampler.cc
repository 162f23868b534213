#include "circline/ransac/sampler.h"

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <utility>

namespace circline {

std::vector<int> RandomOrder(int n, std::uint64_t seed) {
  std::vector<int> order(static_cast<std::size_t>(std::max(n, 0)));
  std::iota(order.begin(), order.end(), 0);
  Random random(seed);
  for (int i = n - 1; i > 0; --i) {
    std::swap(order[static_cast<std::size_t>(i)],
              order[static_cast<std::size_t>(random.UniformInt(i + 1))]);
  }
  return order;
}

void DrawSample(int n, int count, Random* random, int* sample) {
  for (int i = 0; i < count; ++i) {
    bool repeated = true;
    while (repeated) {
      sample[i] = random->UniformInt(n);
      repeated = std::find(sample, sample + i, sample[i]) != sample + i;
    }
  }
}

}  // namespace circline
