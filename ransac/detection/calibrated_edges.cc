#include "circline/ransac/detection/calibrated_edges.h"

#include <array>

namespace circline {
namespace {

using Eigen::Vector2d;

// Reach of the linear approximation, pixels: its error is 0.005 px at 2.5 px in the strongest
// distortion, and grows with the square.
constexpr float kReachPx = 2.5f;
// From an anchor this near the next one is found in a step or two of Newton's method, pixels.
constexpr double kNearPx = 30.0;
// A step of this length leaves 1e-6 px, as convergence is quadratic.
constexpr double kSmallStepPx = 0.02;

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
  const bool known = (last_ != nullptr && ContinueFrom(*last_, anchor)) ||
                     PixelToCalibrated(camera_, Vector2d(anchor->u, anchor->v), &anchor->point);
  anchor->state = known ? State::kKnown : State::kNone;
  if (known) last_ = anchor;
}

// From a known anchor nearby by Newton's method; false where it does not settle at once.
bool CalibratedEdges::ContinueFrom(const Anchor& known, Anchor* anchor) const {
  if (camera_.model != CameraModel::kOpenCV) return false;
  const Vector2d target(anchor->u, anchor->v);
  Vector2d miss = target - Vector2d(known.u, known.v);
  if (!(miss.squaredNorm() < kNearPx * kNearPx)) return false;
  CalibratedPoint at = known.point;
  constexpr int kMaxSteps = 3;
  for (int k = 0; k <= kMaxSteps; ++k) {
    const std::array<double, 4>& step = at.x_from_pixel;
    at.x +=
        Vector2d(step[0] * miss.x() + step[1] * miss.y(), step[2] * miss.x() + step[3] * miss.y());
    if (k > 0 && miss.squaredNorm() < kSmallStepPx * kSmallStepPx) {
      anchor->point = at;
      return true;
    }
    Vector2d pixel;
    std::array<double, 4> j;
    DistortWithJacobian(camera_, at.x, &pixel, &j);
    const double det = j[0] * j[3] - j[1] * j[2];
    if (!(det > 0.0)) return false;
    at.x_from_pixel = {j[3] / det, -j[1] / det, -j[2] / det, j[0] / det};
    miss = target - pixel;
  }
  return false;
}

}  // namespace circline
