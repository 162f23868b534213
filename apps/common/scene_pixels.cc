#include "apps/common/scene_pixels.h"

#include <string>

namespace circline::apps {

Eigen::Vector2d ReadPixel(const StorageNode& node) {
  const std::vector<double> v = node.Numbers(2);
  return v.empty() ? Eigen::Vector2d::Zero() : Eigen::Vector2d(v[0], v[1]);
}

std::vector<Eigen::Vector2d> ReadPixels(const StorageNode& node, std::size_t least) {
  const std::vector<double> v = node.Numbers(0, 2);
  std::vector<Eigen::Vector2d> points;
  for (std::size_t i = 0; i + 1 < v.size(); i += 2) points.emplace_back(v[i], v[i + 1]);
  if (points.size() < least) {
    node.Fail("must have " + std::to_string(least) + " points or more, has " +
              std::to_string(points.size()));
  }
  return points;
}

}  // namespace circline::apps
