// Outliers in a dense cluster may look like a piece of a curve to a robust fit. Their many
// neighbours tell: the points of a contour or a line are spread along it. Internal: not installed.
#ifndef CIRCLINE_RANSAC_DENSE_CLUSTERS_H_
#define CIRCLINE_RANSAC_DENSE_CLUSTERS_H_

#include <algorithm>
#include <cstddef>
#include <vector>

namespace circline {

// Those of n points without far more neighbours than the loneliest fifth has. near(i, j): whether
// two are neighbours, within three thresholds of an inlier. `stand_ins`: so many, the first `j`,
// count for all; near() must spread them over all points where they are fewer than n.
template <typename Near>
std::vector<int> OutsideClusters(int n, int stand_ins, const Near& near) {
  if (n == 0) return {};
  std::vector<int> neighbors(static_cast<std::size_t>(n), 0);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < std::min(n, stand_ins); ++j)
      neighbors[static_cast<std::size_t>(i)] += near(i, j) ? 1 : 0;
  }
  std::vector<int> sorted = neighbors;
  std::nth_element(sorted.begin(), sorted.begin() + n / 5, sorted.end());
  const int limit = 4 * (sorted[static_cast<std::size_t>(n / 5)] + 1);
  std::vector<int> indices;
  for (int i = 0; i < n; ++i) {
    if (neighbors[static_cast<std::size_t>(i)] <= limit) indices.push_back(i);
  }
  return indices;
}

// Radius of the neighbourhood, thresholds of an inlier.
constexpr double kClusterThresholds = 3.0;

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DENSE_CLUSTERS_H_
