#include "circline/ransac/detection/structure/box_edge.h"

#include <cmath>

#include "circline/ransac/detection/lines/segment_meetings.h"
#include "circline/ransac/detection/structure/detect_pencils.h"

namespace circline {
namespace {

using Eigen::Vector3d;

// What all points of an edge share, pixels: cartons are worn and bulge.
constexpr double kWornPx = 0.35;
// What lens and calibration leave beyond that, radians.
constexpr double kModelSigmaRad = 1.7e-3;
// The logarithm of the odds, before its direction is looked at, that a line that forms corners is
// an edge of the box (the choice between three directions not counted).
constexpr double kLogOddsOfAnEdge = -1.5;

}  // namespace

LineFit WornEdge(const DetectedLine& line) {
  return WithDirectionError(WithSharedError(line, kWornPx), kModelSigmaRad);
}

double LogOddsOfEdge(const LineOdds& line, const Vector3d& axis, double off_variance) {
  const double variance = line.Variance(axis) + off_variance;
  return line.LogRatio(axis, variance) - std::log(3.0) + kLogOddsOfAnEdge;
}

double LogOddsOfDirection(const std::vector<DetectedLine>& lines, const std::vector<int>& members,
                          const Vector3d& direction) {
  double sum = 0.0;
  for (const int i : members)
    sum += LogOddsOfEdge(LineOdds(WornEdge(lines[static_cast<std::size_t>(i)])), direction, 0.0);
  return sum;
}

std::vector<std::vector<std::size_t>> FindCorners(const std::vector<DetectedLine>& lines,
                                                  double diagonal_px, double min_length_px) {
  const std::vector<int> twin_of = FindTwins(lines, diagonal_px);
  const auto counts = [&](std::size_t i) {
    return twin_of[i] < 0 && lines[i].length_px >= min_length_px;
  };
  std::vector<std::vector<std::size_t>> corners(lines.size());
  for (std::size_t i = 0; i < lines.size(); ++i) {
    for (std::size_t j = i + 1; j < lines.size() && counts(i); ++j) {
      if (!counts(j) || !FormCorner(lines[i].ends, lines[j].ends, diagonal_px)) continue;
      corners[i].push_back(j);
      corners[j].push_back(i);
    }
  }
  return corners;
}

}  // namespace circline
