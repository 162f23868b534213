#include "circline/ransac/sampler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <set>

namespace circline {
namespace {

TEST(RandomOrder, IsAPermutation) {
  const std::vector<int> order = RandomOrder(100, 5);
  EXPECT_EQ(std::set<int>(order.begin(), order.end()).size(), 100u);
  EXPECT_EQ(*std::max_element(order.begin(), order.end()), 99);
  EXPECT_EQ(order, RandomOrder(100, 5));
  EXPECT_TRUE(RandomOrder(0, 5).empty());
}

TEST(DrawSample, DrawsAllAlike) {
  constexpr int n = 10, m = 4, draws = 100000;
  Random random(1);
  std::array<int, m> sample{};
  std::vector<int> drawn(n, 0);
  for (int i = 0; i < draws; ++i) {
    DrawSample(n, m, &random, sample.data());
    EXPECT_EQ(std::set<int>(sample.begin(), sample.end()).size(), static_cast<std::size_t>(m));
    for (const int s : sample) ++drawn[static_cast<std::size_t>(s)];
  }
  for (const int count : drawn) EXPECT_NEAR(count, 1.0 * draws * m / n, 800);
}

}  // namespace
}  // namespace circline
