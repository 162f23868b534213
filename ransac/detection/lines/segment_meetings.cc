#include "circline/ransac/detection/lines/segment_meetings.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "circline/estimators/basics.h"

namespace circline {
namespace {

using Eigen::Vector2d;

// The sides of chessboard squares form corners; the lines of a printed border, of a window and its
// frame, keep a small distance. Shares of the photo's diagonal.
constexpr double kCornerShareOfPhoto = 10.0 / kUsualDiagonalPx;
constexpr double kNearShareOfPhoto = 25.0 / kUsualDiagonalPx;
// Of FormCorner.
constexpr double kCornerShare = 0.45;
constexpr double kMinCornerGap = 9.0 / kUsualDiagonalPx;  // Shares of the diagonal.
constexpr double kMinCornerSine = 0.17;
constexpr double kFullMeetings = 3.0;
constexpr int kCoreMeetings = 2;

double PointSegmentDistance(const Vector2d& p, const Segment& s) {
  const Vector2d d = s[1] - s[0];
  const double t = std::clamp((p - s[0]).dot(d) / std::max(d.squaredNorm(), 1e-12), 0.0, 1.0);
  return (p - s[0] - t * d).norm();
}

// Whether the rectangles about two segments are farther apart than `px`.
bool FarApart(const Segment& s, const Segment& t, double px) {
  for (int k = 0; k < 2; ++k) {
    if (std::min(s[0][k], s[1][k]) > std::max(t[0][k], t[1][k]) + px) return true;
    if (std::min(t[0][k], t[1][k]) > std::max(s[0][k], s[1][k]) + px) return true;
  }
  return false;
}

bool AreWithin(double px, const Segment& s, const Segment& t) {
  return !FarApart(s, t, px) && SegmentDistance(s, t) < px;
}

cv::Point2f ToPoint(const Vector2d& p) {
  return {static_cast<float>(p.x()), static_cast<float>(p.y())};
}

double Length(const Segment& s) { return (s[1] - s[0]).norm(); }

// Where they are not zero; adds the lengths of those segments.
std::vector<int> Chosen(const Eigen::VectorXi& marks, const std::vector<Segment>& segments,
                        double* length) {
  std::vector<int> indices;
  for (int i = 0; i < static_cast<int>(segments.size()); ++i) {
    if (marks[i] == 0) continue;
    indices.push_back(i);
    *length += Length(segments[static_cast<std::size_t>(i)]);
  }
  return indices;
}

}  // namespace

double SegmentDistance(const Segment& s, const Segment& t) {
  const auto side = [](const Segment& line, const Vector2d& p) {
    return Cross(line[1] - line[0], p - line[0]);
  };
  if (side(s, t[0]) * side(s, t[1]) < 0.0 && side(t, s[0]) * side(t, s[1]) < 0.0) return 0.0;
  return std::min({PointSegmentDistance(s[0], t), PointSegmentDistance(s[1], t),
                   PointSegmentDistance(t[0], s), PointSegmentDistance(t[1], s)});
}

bool LiesAlong(const Segment& s, const Segment& t, double px) {
  return !FarApart(s, t, px) && PointSegmentDistance(s[0], t) < px &&
         PointSegmentDistance(s[1], t) < px;
}

bool AreNear(const Segment& s, const Segment& t, double diagonal_px) {
  return AreWithin(kNearShareOfPhoto * diagonal_px, s, t);
}

Vector2d Crossing(const Segment& s, const Segment& t) {
  const Vector2d d = s[1] - s[0], e = t[1] - t[0];
  return s[0] + d * (Cross(t[0] - s[0], e) / Cross(d, e));
}

bool FormCorner(const Segment& s, const Segment& t, double diagonal_px) {
  const double least = kMinCornerGap * diagonal_px, most = kMaxCornerGap * diagonal_px;
  if (FarApart(s, t, 2.0 * most)) return false;
  const Vector2d d = s[1] - s[0], e = t[1] - t[0];
  const double d_length = d.norm(), e_length = e.norm();
  if (std::abs(Cross(d, e)) <= kMinCornerSine * d_length * e_length) return false;
  const Vector2d crossing = Crossing(s, t);
  const auto ends_there = [&](const Segment& segment, double length) {
    const double gap = std::min((crossing - segment[0]).norm(), (crossing - segment[1]).norm());
    return gap <= std::clamp(kCornerShare * length, least, most);
  };
  return ends_there(s, d_length) && ends_there(t, e_length);
}

double MeetingLength(const std::vector<Segment>& a, const std::vector<Segment>& b,
                     double diagonal_px) {
  double length = 0.0;
  for (const Segment& s : a) {
    const auto meetings = std::count_if(
        b.begin(), b.end(), [&](const Segment& t) { return AreNear(s, t, diagonal_px); });
    const double share = std::min(1.0, static_cast<double>(meetings) / kFullMeetings);
    length += Length(s) * share;
  }
  return length;
}

std::array<std::vector<int>, 2> ConnectedCore(const std::vector<Segment>& a,
                                              const std::vector<Segment>& b, double diagonal_px) {
  const auto n = static_cast<Eigen::Index>(a.size()), m = static_cast<Eigen::Index>(b.size());
  Eigen::MatrixXi meets(n, m);
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < m; ++j) {
      meets(i, j) = AreWithin(kCornerShareOfPhoto * diagonal_px, a[static_cast<std::size_t>(i)],
                              b[static_cast<std::size_t>(j)]);
    }
  }
  // To drop what has too few meetings leaves others with too few.
  for (int before = -1; before != meets.sum();) {
    before = meets.sum();
    for (auto row : meets.rowwise()) row *= row.sum() < kCoreMeetings ? 0 : 1;
    for (auto column : meets.colwise()) column *= column.sum() < kCoreMeetings ? 0 : 1;
  }
  std::array<std::vector<int>, 2> largest;
  double largest_length = 0.0;
  for (Eigen::Index start = 0; start < n; ++start) {
    if (meets.row(start).isZero()) continue;
    Eigen::VectorXi rows = Eigen::VectorXi::Unit(n, start), columns;
    for (int before = 0; before != rows.sum();) {
      before = rows.sum();
      columns = (meets.transpose() * rows).cwiseMin(1);
      rows = (meets * columns).cwiseMin(1);
    }
    double length = 0.0;
    std::array<std::vector<int>, 2> component = {Chosen(rows, a, &length),
                                                 Chosen(columns, b, &length)};
    for (const int i : component[0]) meets.row(i).setZero();
    if (length <= largest_length) continue;
    largest_length = length;
    largest = std::move(component);
  }
  return largest;
}

ConvexRegion::ConvexRegion(const std::vector<Vector2d>& points, double grow) {
  std::vector<cv::Point2f> cloud;
  for (const Vector2d& p : points) cloud.push_back(ToPoint(p));
  if (!cloud.empty()) cv::convexHull(cloud, corners_);
  cv::Point2f centre(0.0F, 0.0F);
  for (const cv::Point2f& p : corners_) centre += p / static_cast<float>(corners_.size());
  for (cv::Point2f& p : corners_) p = centre + static_cast<float>(grow) * (p - centre);
}

bool ConvexRegion::Contains(const Vector2d& point) const {
  return corners_.size() >= 3 && cv::pointPolygonTest(corners_, ToPoint(point), false) >= 0.0;
}

}  // namespace circline
