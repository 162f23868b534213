#include "circline/ransac/calibrated_edges.h"

#include <algorithm>
#include <array>

namespace circline {
namespace {

// Neighbours that are undistorted together, and the reach of the linear approximation, pixels: its
// error is 0.005 px at 2.5 px in the strongest distortion, and grows with the square. A fisheye
// bends too fast towards its border.
constexpr int kGroup = 5;
constexpr double kReachPx = 3.0;

}  // namespace

CalibratedEdges::CalibratedEdges(const EdgeMap& map, const Camera& camera)
    : map_(map), camera_(camera), where_(map.points.size(), kUnknown) {
  points_.reserve(map.points.size());
}

// The group of point i, about its middle.
void CalibratedEdges::Calibrate(int i) {
  const int begin = i - i % kGroup;
  const int end = std::min(begin + kGroup, static_cast<int>(map_.points.size()));
  const Eigen::Vector2d middle =
      map_.points[static_cast<std::size_t>((begin + end) / 2)].Position();
  CalibratedPoint anchor;
  const bool usable =
      camera_.model != CameraModel::kFisheye && PixelToCalibrated(camera_, middle, &anchor);
  const std::array<double, 4>& j = anchor.x_from_pixel;
  for (int k = begin; k < end; ++k) {
    const Eigen::Vector2d pixel = map_.points[static_cast<std::size_t>(k)].Position();
    const Eigen::Vector2d shift = pixel - middle;
    CalibratedPoint point = anchor;
    if (usable && shift.squaredNorm() < kReachPx * kReachPx) {
      point.x +=
          Eigen::Vector2d(j[0] * shift.x() + j[1] * shift.y(), j[2] * shift.x() + j[3] * shift.y());
      Append(k, point);
    } else if (PixelToCalibrated(camera_, pixel, &point)) {
      Append(k, point);
    } else {
      where_[static_cast<std::size_t>(k)] = kNone;
    }
  }
}

void CalibratedEdges::Append(int i, const CalibratedPoint& point) {
  where_[static_cast<std::size_t>(i)] = static_cast<std::int32_t>(points_.size());
  points_.push_back(point);
}

}  // namespace circline
