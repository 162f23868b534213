#include "circline/ransac/detection/local_pencils.h"

#include <Eigen/Core>
#include <cmath>
#include <cstddef>
#include <utility>

#include "circline/ransac/detection/segment_meetings.h"

namespace circline {
namespace {

// The region in which lines meet is widened by this factor: the outermost lines meet none.
constexpr double kRegionGrowth = 1.1;
// Lines that miss a direction by up to this are alike, radians.
constexpr double kAlikeRad = 0.05;
// It is one thing if its lines are this share of either pencil's length.
constexpr double kMinLocalShare = 0.5;
// The region is looked for so often, each time with the directions that the last one gave.
constexpr int kPasses = 4;

// The lines of the region in which lines of about the directions of two pencils form corners.
std::vector<int> LinesWhereTheyMeet(const std::vector<DetectedLine>& lines,
                                    const std::array<DetectedPencil, 2>& pair, double diagonal_px) {
  std::array<std::vector<Segment>, 2> alike;
  for (std::size_t k = 0; k < 2; ++k) {
    const Eigen::Vector3d& direction = pair[k].observation.fit->direction;
    for (const DetectedLine& line : lines) {
      if (std::abs(line.fit.line.dot(direction)) < kAlikeRad) alike[k].push_back(line.ends);
    }
  }
  const std::array<std::vector<int>, 2> core = ConnectedCore(alike[0], alike[1], diagonal_px);
  std::vector<Eigen::Vector2d> points;
  for (std::size_t k = 0; k < 2; ++k) {
    for (const int i : core[k]) {
      const Segment& s = alike[k][static_cast<std::size_t>(i)];
      points.insert(points.end(), s.begin(), s.end());
    }
  }
  const ConvexRegion region(std::move(points), kRegionGrowth);
  std::vector<int> inside;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (region.Contains(lines[i].ends)) inside.push_back(static_cast<int>(i));
  }
  return inside;
}

}  // namespace

bool RefitWhereTheyMeet(const std::vector<DetectedLine>& lines, std::array<DetectedPencil, 2>* pair,
                        double diagonal_px) {
  std::array<DetectedPencil, 2> local = *pair;
  std::vector<int> before;
  for (int pass = 0; pass < kPasses; ++pass) {
    std::vector<int> inside = LinesWhereTheyMeet(lines, local, diagonal_px);
    if (pass > 0 && inside == before) break;
    for (DetectedPencil& pencil : local) {
      if (!RefitPencil(lines, inside, &pencil, diagonal_px)) return false;
    }
    before = std::move(inside);
  }
  for (std::size_t k = 0; k < 2; ++k) {
    if (local[k].support_px < kMinLocalShare * (*pair)[k].support_px) return false;
  }
  *pair = std::move(local);
  return true;
}

}  // namespace circline
