#include "circline/ransac/sampler.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
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

TEST(Sampler, ProsacGrowsFromTheBestToAll) {
  constexpr int n = 20, m = 3;
  std::vector<int> order(n);
  for (int i = 0; i < n; ++i) order[static_cast<std::size_t>(i)] = n - 1 - i;
  Sampler sampler;
  sampler.Reset(n, m, 1, &order);
  std::array<int, m> sample{};
  sampler.Draw(sample.data());
  EXPECT_EQ(std::set<int>(sample.begin(), sample.end()), (std::set<int>{19, 18, 17}));
  std::vector<int> drawn(n, 0);
  for (int i = 0; i < 300000; ++i) {
    sampler.Draw(sample.data());
    if (i < 200000) continue;
    for (const int s : sample) ++drawn[static_cast<std::size_t>(s)];
  }
  for (const int count : drawn) EXPECT_NEAR(count, 100000.0 * m / n, 500);  // 4.4 sigma.
}

TEST(Sampler, ProsacGrowsByThePaper) {
  // T_n = T_N C(n, m) / C(N, m); the pool grows from n to n + 1 after ceil(T_(n + 1) - T_n) draws,
  // and each draw has the newest of the pool (Chum and Matas 2005, section 2.1).
  constexpr int n_all = 12, m = 2, uniform_after = 600;
  std::vector<int> order(n_all);
  for (int i = 0; i < n_all; ++i) order[static_cast<std::size_t>(i)] = i;
  Sampler sampler;
  sampler.Reset(n_all, m, 3, &order, uniform_after);
  const auto expected_draws = [](int n) {
    return uniform_after * (n * (n - 1.0)) / (n_all * (n_all - 1.0));
  };
  int pool = m, until = 1;
  for (int draw = 1; pool < n_all; ++draw) {
    if (draw > until) {
      until += static_cast<int>(std::ceil(expected_draws(pool + 1) - expected_draws(pool) - 1e-9));
      ++pool;
    }
    std::array<int, m> sample{};
    sampler.Draw(sample.data());
    EXPECT_EQ(std::max(sample[0], sample[1]), pool - 1) << draw;
  }
}

TEST(Sampler, UniformDrawsAllAlike) {
  constexpr int n = 10, m = 4, draws = 100000;
  Sampler sampler;
  sampler.Reset(n, m, 1, nullptr);
  std::array<int, m> sample{};
  std::vector<int> drawn(n, 0);
  for (int i = 0; i < draws; ++i) {
    sampler.Draw(sample.data());
    EXPECT_EQ(std::set<int>(sample.begin(), sample.end()).size(), static_cast<std::size_t>(m));
    for (const int s : sample) ++drawn[static_cast<std::size_t>(s)];
  }
  for (const int count : drawn) EXPECT_NEAR(count, 1.0 * draws * m / n, 800);
}

}  // namespace
}  // namespace circline
