// Pixels of a photo in a scene file: u, v each.
#ifndef CIRCLINE_APPS_COMMON_SCENE_PIXELS_H_
#define CIRCLINE_APPS_COMMON_SCENE_PIXELS_H_

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "apps/common/storage_node.h"

namespace circline::apps {

// The origin, and an error noted, where it is not one.
Eigen::Vector2d ReadPixel(const StorageNode& node);

// Notes an error where there are fewer than `least`.
std::vector<Eigen::Vector2d> ReadPixels(const StorageNode& node, std::size_t least);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_SCENE_PIXELS_H_
