#include "apps/reconstruct/box_support.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace circline::apps {
namespace {

constexpr double kAlongRad = 0.05;   // A line along a direction, on the photo: three degrees,
constexpr double kAlongPx = 2.0;     // or that much at its ends.
constexpr double kOverrunPx = 60.0;  // Beyond a corner; what lies farther off is another thing.
constexpr double kFreeRunPx = 3.0;   // Lines end a little beyond rounded corners.
constexpr double kGapWeight = 0.5;

void LongestFirst(std::vector<FlatLine>* lines) {
  std::stable_sort(lines->begin(), lines->end(), [](const FlatLine& a, const FlatLine& b) {
    return (a.ends[1] - a.ends[0]).norm() > (b.ends[1] - b.ends[0]).norm();
  });
}

}  // namespace

std::vector<FlatLine> FlatLines(const std::vector<DetectedLine>& lines, const Camera& camera) {
  std::vector<FlatLine> flat;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    FlatLine line;
    line.plane = lines[i].fit.line;
    line.index = static_cast<int>(i);
    bool seen = true;
    for (std::size_t k = 0; k < 2; ++k) {
      CalibratedPoint point;
      seen = seen && PixelToCalibrated(camera, lines[i].ends[k], &point);
      line.ends[k] = camera.fx * point.x;
    }
    if (seen) flat.push_back(line);
  }
  LongestFirst(&flat);
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

bool RunsAlong(const FlatLine& line, const Eigen::Vector2d& a, const Eigen::Vector2d& b,
               double near_px, double* begin, double* end) {
  const double length = (b - a).norm();
  if (!(length > 0.0)) return false;
  const Eigen::Vector2d along = (b - a) / length, across(-along.y(), along.x());
  double t0 = along.dot(line.ends[0] - a), t1 = along.dot(line.ends[1] - a);
  double d0 = across.dot(line.ends[0] - a), d1 = across.dot(line.ends[1] - a);
  if (t0 > t1) {
    std::swap(t0, t1);
    std::swap(d0, d1);
  }
  const double from = std::max(t0, 0.0), to = std::min(t1, length);
  if (!(to > from) || !(t1 > t0)) return false;
  const double slope = (d1 - d0) / (t1 - t0);
  if (std::abs(d0 + slope * (from - t0)) > near_px || std::abs(d0 + slope * (to - t0)) > near_px)
    return false;
  *begin = t0;
  *end = t1;
  return true;
}

double EdgeSupport(const std::vector<FlatLine>& along, const Eigen::Vector2d& a,
                   const Eigen::Vector2d& b, double near_px) {
  const double length = (b - a).norm();
  std::vector<std::array<double, 2>> parts;
  double before = 0.0, beyond = 0.0;
  for (const FlatLine& line : along) {
    double begin, end;
    if (!RunsAlong(line, a, b, near_px, &begin, &end)) continue;
    before = std::max(before, std::min(-begin - kFreeRunPx, kOverrunPx));
    beyond = std::max(beyond, std::min(end - length - kFreeRunPx, kOverrunPx));
    parts.push_back({std::max(begin, 0.0), std::min(end, length)});
  }
  std::sort(parts.begin(), parts.end());
  double sum = 0.0, reached = 0.0;
  for (const auto& part : parts) {
    sum += std::max(0.0, part[1] - std::max(part[0], reached));
    reached = std::max(reached, part[1]);
  }
  return sum - kGapWeight * (length - sum) - before - beyond;
}

}  // namespace circline::apps
