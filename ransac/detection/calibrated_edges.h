// The points of an edge map in calibrated coordinates.
#ifndef CIRCLINE_RANSAC_DETECTION_CALIBRATED_EDGES_H_
#define CIRCLINE_RANSAC_DETECTION_CALIBRATED_EDGES_H_

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/ransac/detection/edges.h"

namespace circline {

// Undistorts points when they are first asked for. Undistorting is what takes longest in detection:
// it is done once for a few neighbours on a chain, near which the camera is linear.
class CalibratedEdges {
 public:
  // Both must outlive it.
  CalibratedEdges(const EdgeMap& map, const Camera& camera);

  // Point i of the map, to 0.01 px at worst; false where the camera cannot undistort it.
  bool Get(int i, CalibratedPoint* point) {
    Anchor* anchor = &anchors_[static_cast<std::size_t>(anchor_of_[static_cast<std::size_t>(i)])];
    if (anchor->state == State::kUnknown) Calibrate(anchor);
    if (anchor->state == State::kNone) return false;
    *point = anchor->point;
    const EdgePoint& edge = map_.points[static_cast<std::size_t>(i)];
    const double u = static_cast<double>(edge.x - anchor->u);
    const double v = static_cast<double>(edge.y - anchor->v);
    point->x.x() += point->x_from_pixel[0] * u + point->x_from_pixel[1] * v;
    point->x.y() += point->x_from_pixel[2] * u + point->x_from_pixel[3] * v;
    return true;
  }

 private:
  enum class State : std::uint8_t { kUnknown, kNone, kKnown };

  // Stands for the points of the map about it.
  struct Anchor {
    CalibratedPoint point;
    float u = 0.0f, v = 0.0f;  // Pixels.
    State state = State::kUnknown;
  };

  void Group();
  void Calibrate(Anchor* anchor);

  const EdgeMap& map_;
  const Camera& camera_;
  std::vector<Anchor> anchors_;
  std::vector<std::int32_t> anchor_of_;  // For each point of the map.
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_CALIBRATED_EDGES_H_
