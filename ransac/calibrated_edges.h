// The points of an edge map in calibrated coordinates.
#ifndef CIRCLINE_RANSAC_CALIBRATED_EDGES_H_
#define CIRCLINE_RANSAC_CALIBRATED_EDGES_H_

#include <cstdint>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/ransac/edges.h"

namespace circline {

// Undistorts points when they are first asked for. Undistorting is what takes longest in detection:
// it is done for one point of a few neighbours on a chain, and near that the camera is linear.
class CalibratedEdges {
 public:
  // Both must outlive it.
  CalibratedEdges(const EdgeMap& map, const Camera& camera);

  // Point i of the map, to 0.01 px at worst; null where the camera cannot undistort it. Pointers
  // stay valid.
  const CalibratedPoint* Get(int i) {
    const auto k = static_cast<std::size_t>(i);
    if (where_[k] == kUnknown) Calibrate(i);
    return where_[k] == kNone ? nullptr : &points_[static_cast<std::size_t>(where_[k])];
  }

 private:
  static constexpr std::int32_t kUnknown = -2, kNone = -1;

  void Calibrate(int i);
  void Append(int i, const CalibratedPoint& point);

  const EdgeMap& map_;
  const Camera& camera_;
  std::vector<CalibratedPoint> points_;  // In the order of asking; never reallocated.
  std::vector<std::int32_t> where_;      // Of each point of the map in points_.
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_CALIBRATED_EDGES_H_
