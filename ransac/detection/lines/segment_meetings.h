// Where the lines of two pencils meet on the photo. Rows and columns, window fronts and shelves,
// the edges of a box cross each other or form corners; directions of different things do not.
#ifndef CIRCLINE_RANSAC_DETECTION_LINES_SEGMENT_MEETINGS_H_
#define CIRCLINE_RANSAC_DETECTION_LINES_SEGMENT_MEETINGS_H_

#include <Eigen/Core>
#include <array>
#include <opencv2/core.hpp>
#include <vector>

#include "circline/estimators/observations.h"

namespace circline {

// Smallest distance between two segments, pixels; 0 where they cross.
double SegmentDistance(const Segment& s, const Segment& t);

// Whether `s` runs along `t`: both of its ends are within `px` of it.
bool LiesAlong(const Segment& s, const Segment& t, double px);

// Distances that decide about structure are shares of the photo's diagonal, so that a photo has the
// same at any size; the figures below are for one of 640 x 480.
constexpr double kUsualDiagonalPx = 800.0;

// Whether they cross or come within 25 pixels.
bool AreNear(const Segment& s, const Segment& t, double diagonal_px = kUsualDiagonalPx);

// Where the lines of two segments that are not parallel cross, pixels.
Eigen::Vector2d Crossing(const Segment& s, const Segment& t);

constexpr double kMaxCornerGap = 21.0 / kUsualDiagonalPx;  // Share of the diagonal.

// Whether both end where their lines cross: within 45 % of their lengths, but of 9 to 21 pixels
// (corners are rounded, and lines stop short of them). Not for lines within ten degrees.
bool FormCorner(const Segment& s, const Segment& t, double diagonal_px = kUsualDiagonalPx);

// Length of the segments of `a`, pixels, each counted by how many of `b` it is near to: fully from
// three on; lines that cross by accident meet one or two.
double MeetingLength(const std::vector<Segment>& a, const std::vector<Segment>& b,
                     double diagonal_px = kUsualDiagonalPx);

// The largest (by length) set of segments of both lists that crossings and corners (to 10
// pixels) between the two lists connect, each of them with two or more of it (a line that touches a
// grid by accident has one): indices into either, ascending. Both empty where there is none.
std::array<std::vector<int>, 2> ConnectedCore(const std::vector<Segment>& a,
                                              const std::vector<Segment>& b,
                                              double diagonal_px = kUsualDiagonalPx);

// A convex region of the photo.
class ConvexRegion {
 public:
  // The convex hull of the points, widened about its centre by the factor `grow`.
  ConvexRegion(const std::vector<Eigen::Vector2d>& points, double grow);

  bool Contains(const Eigen::Vector2d& point) const;
  bool Contains(const Segment& s) const { return Contains(s[0]) && Contains(s[1]); }

 private:
  std::vector<cv::Point2f> corners_;  // In order.
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_LINES_SEGMENT_MEETINGS_H_
