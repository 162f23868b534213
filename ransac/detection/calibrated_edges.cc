#include "circline/ransac/detection/calibrated_edges.h"

namespace circline {
namespace {

// Reach of the linear approximation, pixels: its error is 0.005 px at 2.5 px in the strongest
// distortion, and grows with the square.
constexpr float kReachPx = 2.5f;

}  // namespace

CalibratedEdges::CalibratedEdges(const EdgeMap& map, const Camera& camera)
    : map_(map), camera_(camera), anchor_of_(map.points.size()) {
  anchors_.reserve(map.points.size() / 4);
  Group();
}

// Points in a row that are near each other share an anchor in the middle of the first and the last:
// all of them without distortion, none with a fisheye, which bends too fast towards its border.
void CalibratedEdges::Group() {
  float square = 4.0f * kReachPx * kReachPx;
  if (camera_.model == CameraModel::kPinhole) square = 1e12f;
  if (camera_.model == CameraModel::kFisheye) square = -1.0f;
  const std::vector<EdgePoint>& points = map_.points;
  const EdgePoint* first = nullptr;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const EdgePoint& p = points[i];
    const float u = first == nullptr ? 1e9f : p.x - first->x;
    const float v = first == nullptr ? 1e9f : p.y - first->y;
    if (!(u * u + v * v <= square)) {
      first = &p;
      anchors_.emplace_back();
    }
    anchors_.back().u = 0.5f * (first->x + p.x);
    anchors_.back().v = 0.5f * (first->y + p.y);
    anchor_of_[i] = static_cast<std::int32_t>(anchors_.size() - 1);
  }
}

void CalibratedEdges::Calibrate(Anchor* anchor) {
  const bool known =
      PixelToCalibrated(camera_, Eigen::Vector2d(anchor->u, anchor->v), &anchor->point);
  anchor->state = known ? State::kKnown : State::kNone;
}

}  // namespace circline
