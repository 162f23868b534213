// What the lines of a photo say for edges of a box.
#ifndef CIRCLINE_APPS_RECONSTRUCT_BOX_SUPPORT_H_
#define CIRCLINE_APPS_RECONSTRUCT_BOX_SUPPORT_H_

#include <Eigen/Core>
#include <array>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/ransac/detection/detect_lines.h"

namespace circline::apps {

// A line of the photo; ends in pixels of the undistorted photo, relative to the principal point.
struct FlatLine {
  std::array<Eigen::Vector2d, 2> ends;
  Eigen::Vector3d plane;  // Normal of the plane through the camera and the line.
  int index = 0;          // Of the DetectedLine.
};

// Longest first.
std::vector<FlatLine> FlatLines(const std::vector<DetectedLine>& lines, const Camera& camera);

// Whether the line, on the photo, may point in the direction.
bool IsAlong(const FlatLine& line, const Eigen::Vector3d& direction, double focal_px);

// Of these, those along the direction, in the same order.
std::vector<FlatLine> LinesAlong(const std::vector<FlatLine>& lines,
                                 const Eigen::Vector3d& direction, double focal_px);

// Where a direction, seen at `at`, points to.
Eigen::Vector2d FlatDirection(const Eigen::Vector3d& direction, const Eigen::Vector2d& at,
                              double focal_px);

// Whether the line runs along the edge from a to b and overlaps it; [begin, end] is then its part
// along it, from a, pixels, and may exceed the edge.
bool RunsAlong(const FlatLine& line, const Eigen::Vector2d& a, const Eigen::Vector2d& b,
               double near_px, double* begin, double* end);

// Covered length of the edge, by lines within `near_px`, less half of what is not, less what runs
// on beyond its ends, pixels.
double EdgeSupport(const std::vector<FlatLine>& along, const Eigen::Vector2d& a,
                   const Eigen::Vector2d& b, double near_px);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_BOX_SUPPORT_H_
