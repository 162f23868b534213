#include "apps/reconstruct/box_support.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

namespace circline::apps {
namespace {

constexpr double kAlongRad = 0.05;   // A line along a direction, on the photo: three degrees,
constexpr double kAlongPx = 2.0;     // or that much at its ends.
constexpr double kOverrunPx = 60.0;  // Beyond a corner; what lies farther off is another thing.
constexpr double kFreeRunPx = 3.0;   // Lines end a little beyond rounded corners.
constexpr double kGapWeight = 0.5;

}  // namespace

std::vector<FlatLine> FlatLines(const std::vector<DetectedLine>& lines, const Camera& camera) {
  std::vector<FlatLine> flat;
  for (const DetectedLine& detected : lines) {
    FlatLine line;
    line.plane = detected.fit.line;
    bool seen = true;
    for (std::size_t k = 0; k < 2; ++k) {
      CalibratedPoint point;
      seen = seen && PixelToCalibrated(camera, detected.ends[k], &point);
      line.ends[k] = camera.fx * point.x;
    }
    if (seen) flat.push_back(line);
  }
  std::stable_sort(flat.begin(), flat.end(), [](const FlatLine& a, const FlatLine& b) {
    return a.LengthPx() > b.LengthPx();
  });
  return flat;
}

Eigen::Vector2d FlatDirection(const Eigen::Vector3d& direction, const Eigen::Vector2d& at,
                              double focal_px) {
  return direction.head<2>() - at / focal_px * direction.z();
}

bool IsAlong(const FlatLine& line, const Eigen::Vector3d& direction, double focal_px) {
  const Eigen::Vector2d run = line.ends[1] - line.ends[0];
  const Eigen::Vector2d towards =
      FlatDirection(direction, 0.5 * (line.ends[0] + line.ends[1]), focal_px);
  const double sine =
      std::abs(run.x() * towards.y() - run.y() * towards.x()) / (run.norm() * towards.norm());
  return sine < std::max(kAlongRad, kAlongPx / run.norm());
}

std::vector<FlatLine> LinesAlong(const std::vector<FlatLine>& lines,
                                 const Eigen::Vector3d& direction, double focal_px) {
  std::vector<FlatLine> along;
  for (const FlatLine& line : lines) {
    if (IsAlong(line, direction, focal_px)) along.push_back(line);
  }
  return along;
}

RaySupport::RaySupport(const std::vector<FlatLine>& along, const Eigen::Vector2d& begin,
                       const Eigen::Vector2d& towards, double near_px)
    : near_px_(near_px) {
  if (!(towards.norm() > 0.0)) return;
  const Eigen::Vector2d ray = towards.normalized(), across(-ray.y(), ray.x());
  for (const FlatLine& line : along) {
    Part part{ray.dot(line.ends[0] - begin), ray.dot(line.ends[1] - begin),
              across.dot(line.ends[0] - begin), 0.0};
    double offset_at_end = across.dot(line.ends[1] - begin);
    if (part.begin > part.end) {
      std::swap(part.begin, part.end);
      std::swap(part.offset, offset_at_end);
    }
    if (!(part.end > std::max(part.begin, 0.0))) continue;
    part.slope = (offset_at_end - part.offset) / (part.end - part.begin);
    const double offset = part.offset + part.slope * std::max(-part.begin, 0.0);
    if (std::abs(offset) <= near_px) parts_.push_back(part);
  }
  std::sort(parts_.begin(), parts_.end(),
            [](const Part& a, const Part& b) { return a.begin < b.begin; });
}

double RaySupport::Of(double length_px) const {
  double before = 0.0, beyond = 0.0, covered = 0.0, reached = 0.0;
  for (const Part& part : parts_) {
    const double from = std::max(part.begin, 0.0), to = std::min(part.end, length_px);
    if (!(to > from)) continue;
    if (std::abs(part.offset + part.slope * (to - part.begin)) > near_px_) continue;
    before = std::max(before, std::min(-part.begin - kFreeRunPx, kOverrunPx));
    beyond = std::max(beyond, std::min(part.end - length_px - kFreeRunPx, kOverrunPx));
    covered += std::max(0.0, to - std::max(from, reached));
    reached = std::max(reached, to);
  }
  return covered - kGapWeight * (length_px - covered) - before - beyond;
}

}  // namespace circline::apps
