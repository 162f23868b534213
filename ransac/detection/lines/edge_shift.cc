#include "circline/ransac/detection/lines/edge_shift.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "circline/estimators/statistics.h"

namespace circline {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

// A line tells the shift if it has this many points of either kind, a photo if it has this many
// such lines.
constexpr int kMinPointsOfSide = 3;
constexpr std::size_t kMinLines = 5;
// An edge belongs to a line if its gradient is this nearly across it (a cosine).
constexpr double kMinCosine = 0.9;
// The median counts if it is this many of its own standard deviations from 0.
constexpr double kMinSigmas = 2.0;
// More than this is no displacement of edges but another structure, pixels.
constexpr double kMaxShiftPx = 0.6;

// Unit gradient of the edge at a point of a line, or else of one beside it, across the line; zero
// where there is none. Points of lines are means over a few pixels.
Vector2d GradientAt(const EdgeMap& edges, const Vector2d& pixel, const Vector2d& across) {
  const int x = static_cast<int>(std::lround(pixel.x()));
  const int y = static_cast<int>(std::lround(pixel.y()));
  const bool steep = std::abs(across.x()) > std::abs(across.y());
  for (const int step :
       {0, -1, 1}) {  // Beside it is along the axis that is nearer to the gradient.
    const int i = steep ? edges.PointAt(x + step, y) : edges.PointAt(x, y + step);
    if (i < 0) continue;
    const Vector2d gradient = edges.points[static_cast<std::size_t>(i)].Normal();
    if (std::abs(gradient.dot(across)) >= kMinCosine) return gradient;
  }
  return Vector2d::Zero();
}

// The gradients along a line; empty unless it has edges of both kinds.
std::vector<Vector2d> GradientsOfBothKinds(const EdgeMap& edges, const DetectedLine& line) {
  const Vector2d along = (line.ends[1] - line.ends[0]).normalized();
  const Vector2d across(-along.y(), along.x());
  std::vector<Vector2d> gradients;
  gradients.reserve(line.points.size());
  int left = 0, right = 0;
  for (const Vector2d& p : line.points) {
    gradients.push_back(GradientAt(edges, p, across));
    const double side = gradients.back().dot(across);
    left += side > 0.0 ? 1 : 0;
    right += side < 0.0 ? 1 : 0;
  }
  if (left < kMinPointsOfSide || right < kMinPointsOfSide) gradients.clear();
  return gradients;
}

// Least squares for place, slope and shift: a point at position u on the line, on an edge of kind
// s = +-1, misses the fitted line by a + c u + s shift. NaN where kind and position cannot be told
// apart.
double ShiftOfLine(const Camera& camera, const DetectedLine& line,
                   const std::vector<Vector2d>& gradients) {
  const double undefined = std::numeric_limits<double>::quiet_NaN();
  const Vector2d middle = 0.5 * (line.ends[0] + line.ends[1]);
  const Vector2d half = 0.5 * (line.ends[1] - line.ends[0]);
  Matrix3d normal = Matrix3d::Zero();
  Vector3d right_side = Vector3d::Zero();
  for (std::size_t i = 0; i < gradients.size(); ++i) {
    CalibratedPoint point;
    if (gradients[i].isZero() || !PixelToCalibrated(camera, line.points[i], &point)) continue;
    const double u = (line.points[i] - middle).dot(half) / half.squaredNorm();
    const double side = point.GradientPerPixel(line.fit.line.head<2>()).dot(gradients[i]);
    const Vector3d row(1.0, u, side > 0.0 ? 1.0 : -1.0);
    normal += row * row.transpose();
    right_side += LineDistancePx(point, line.fit.line) * row;
  }
  const double n = normal(0, 0);
  if (!(normal.determinant() > 1e-3 * n * n * n)) return undefined;
  const double shift = (normal.inverse() * right_side).z();
  return std::abs(shift) <= kMaxShiftPx ? shift : undefined;
}

// The median over the lines that tell it, or 0.
double CommonShift(const Camera& camera, const std::vector<DetectedLine>& lines,
                   const std::vector<std::vector<Vector2d>>& gradients) {
  std::vector<double> shifts;
  for (std::size_t k = 0; k < lines.size(); ++k) {
    if (gradients[k].empty()) continue;
    const double shift = ShiftOfLine(camera, lines[k], gradients[k]);
    if (std::isfinite(shift)) shifts.push_back(shift);
  }
  if (shifts.size() < kMinLines) return 0.0;
  const double median = Median(shifts);
  std::vector<double> deviations;
  for (const double shift : shifts) deviations.push_back(std::abs(shift - median));
  // 1.4826 makes a median of deviations a standard deviation, 1.2533 one of a mean that of a
  // median.
  const double sigma =
      1.2533 * 1.4826 * Median(deviations) / std::sqrt(static_cast<double>(shifts.size()));
  return std::abs(median) > kMinSigmas * sigma ? median : 0.0;
}

void MoveBack(const Camera& camera, const std::vector<Vector2d>& gradients, double shift,
              DetectedLine* line) {
  DetectedLine moved = *line;
  std::vector<CalibratedPoint> calibrated;
  for (std::size_t i = 0; i < gradients.size(); ++i) {
    moved.points[i] -= shift * gradients[i];
    CalibratedPoint point;
    if (PixelToCalibrated(camera, moved.points[i], &point)) calibrated.push_back(point);
  }
  // The scatter was part staircase.
  if (FitAverages(calibrated, &moved)) *line = std::move(moved);
}

}  // namespace

double UndoEdgeShift(const EdgeMap& edges, const Camera& camera, std::vector<DetectedLine>* lines) {
  std::vector<std::vector<Vector2d>> gradients;
  for (const DetectedLine& line : *lines) gradients.push_back(GradientsOfBothKinds(edges, line));
  const double shift = CommonShift(camera, *lines, gradients);
  for (std::size_t k = 0; k < lines->size() && shift != 0.0; ++k) {
    if (!gradients[k].empty()) MoveBack(camera, gradients[k], shift, &(*lines)[k]);
  }
  return shift;
}

}  // namespace circline
