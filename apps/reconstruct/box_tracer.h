// Boxes that the lines of a photo speak for.
#ifndef CIRCLINE_APPS_RECONSTRUCT_BOX_TRACER_H_
#define CIRCLINE_APPS_RECONSTRUCT_BOX_TRACER_H_

#include <Eigen/Core>
#include <array>
#include <limits>
#include <vector>

#include "apps/reconstruct/box_support.h"
#include "circline/estimators/camera.h"
#include "circline/ransac/detection/lines/detect_lines.h"

namespace circline::apps {

// The box by its nearest corner. Its scale is that of the corner, whose depth is 1.
struct TracedBox {
  Eigen::Vector3d corner;
  std::array<Eigen::Vector3d, 3> axis;  // Unit, from the corner along the box.
  std::array<double, 3> length{};
  std::array<bool, 3> faces{};  // Whether the face at the corner across this axis is seen.
  double score = -std::numeric_limits<double>::infinity();

  // The corner moved along the edges by these shares of them.
  Eigen::Vector3d Point(const std::array<double, 3>& share) const;
};

// Of the visible edges.
struct VisibleLength {
  double all_px = 0.0, shortest_px = std::numeric_limits<double>::infinity();
};
VisibleLength VisibleEdgesPx(const TracedBox& box, double focal_px);

// For each of some candidates of the box's axes the box that lines support best, in no order. The
// candidates are `axes` (columns, camera frame, without sense), and those that have one axis in
// common with these or with a pencil of the photo and for which corners of lines speak most.
// `flat`: FlatLines(lines).
std::vector<TracedBox> TraceLines(const std::vector<DetectedLine>& lines,
                                  const std::vector<FlatLine>& flat, const Camera& camera,
                                  const std::vector<Eigen::Matrix3d>& axes);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_BOX_TRACER_H_
