// What the lines of a photo say for edges of a box.
#ifndef CIRCLINE_APPS_RECONSTRUCT_BOX_SUPPORT_H_
#define CIRCLINE_APPS_RECONSTRUCT_BOX_SUPPORT_H_

#include <Eigen/Core>
#include <array>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/ransac/detection/lines/detect_lines.h"

namespace circline::apps {

// A line of the photo; ends in pixels of the undistorted photo, relative to the principal point.
struct FlatLine {
  std::array<Eigen::Vector2d, 2> ends;
  Eigen::Vector3d plane;  // Normal of the plane through the camera and the line.

  double LengthPx() const { return (ends[1] - ends[0]).norm(); }
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

// What lines of the photo say for the edges of a box that begin at a point of it and end anywhere
// on a ray.
class RaySupport {
 public:
  // `along`: LinesAlong the edge; those within `near_px` of it speak for it.
  RaySupport(const std::vector<FlatLine>& along, const Eigen::Vector2d& begin,
             const Eigen::Vector2d& towards, double near_px);

  // Covered length of an edge this long, less half of what is not covered, less what runs on beyond
  // its ends; pixels.
  double Of(double length_px) const;

 private:
  // Of a line: where it begins and ends along the ray, its offset across the ray where it begins,
  // and the slope of that.
  struct Part {
    double begin, end, offset, slope;
  };
  std::vector<Part> parts_;  // By where they begin.
  double near_px_;
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_BOX_SUPPORT_H_
