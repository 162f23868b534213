// Values of a scene file. Each notes an error and returns zeros where it is not what it should be.
#ifndef CIRCLINE_APPS_COMMON_SCENE_VALUES_H_
#define CIRCLINE_APPS_COMMON_SCENE_VALUES_H_

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "apps/common/solids.h"
#include "apps/common/storage_node.h"
#include "apps/common/text.h"
#include "circline/estimators/observations.h"

namespace circline::apps {

Eigen::Vector2d ReadPixel(const StorageNode& node);
// Notes an error where there are fewer than `least`.
std::vector<Eigen::Vector2d> ReadPixels(const StorageNode& node, std::size_t least);
Segment ReadSegment(const StorageNode& node);
std::vector<Segment> ReadSegments(const StorageNode& node);
// x, y, width, height, grown to whole pixels.
std::array<int, 4> ReadRectangle(const StorageNode& node);

// A positive number, or 0 where it is not given.
double ReadPositive(const StorageNode& node);
// Empty where it is not given.
std::string ReadOptionalText(const StorageNode& node);
// The value, counted from 0, that has this one of the names; `otherwise` where it is not given.
template <typename Value>
Value ReadChoice(const StorageNode& node, const std::vector<std::string>& names, Value otherwise) {
  if (!node.Exists()) return otherwise;
  const std::string name = node.Text();
  const auto found = std::find(names.begin(), names.end(), name);
  if (found != names.end()) return static_cast<Value>(found - names.begin());
  node.Fail(NotOneOf(name, names));
  return otherwise;
}
Eigen::Vector3d ReadVector3(const StorageNode& node);
// The nearest rotation, so that nine printed digits do not cost accuracy.
Eigen::Matrix3d ReadRotation(const StorageNode& node);

// The keys `faces` and `solids` of an image's node; `observations`: its circles, which solids may
// name.
Solids ReadSolids(const StorageNode& image, const Observations& observations);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_SCENE_VALUES_H_
