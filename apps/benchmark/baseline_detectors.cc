#include "apps/benchmark/baseline_detectors.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#ifdef CIRCLINE_HAVE_XIMGPROC
#include <opencv2/ximgproc/edge_drawing.hpp>

#include "circline/estimators/basics.h"
#endif

namespace circline::benchmark {
namespace {

Ellipse MakeEllipse(double x, double y, double a, double b, double angle_deg) {
  Ellipse e;
  e.center = {x, y};
  e.a = std::max(a, b);
  e.b = std::min(a, b);
  e.angle = kDegree * (a >= b ? angle_deg : angle_deg + 90.0);
  return e;
}

// Whether the contour keeps to the ellipse: first-order distances of 1 px root mean square.
bool Follows(const std::vector<cv::Point>& contour, const Ellipse& e) {
  const Eigen::Matrix3d conic = EllipseToConic(e);
  double sum = 0.0;
  for (const cv::Point& p : contour) {
    CalibratedPoint point;  // Pixels throughout.
    point.x = {p.x, p.y};
    const double d = ConicDistancePx(point, conic);
    sum += d * d;
  }
  return sum <= static_cast<double>(contour.size());
}

std::vector<Ellipse> CannyEllipses(const cv::Mat& gray) {
  cv::Mat edges;
  cv::Canny(gray, edges, 50.0, 150.0);
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(edges, contours, cv::RETR_LIST, cv::CHAIN_APPROX_NONE);
  std::vector<Ellipse> ellipses;
  for (const std::vector<cv::Point>& contour : contours) {
    if (contour.size() < 20) continue;
    const cv::RotatedRect r = cv::fitEllipseDirect(contour);
    const Ellipse e =
        MakeEllipse(static_cast<double>(r.center.x), static_cast<double>(r.center.y),
                    0.5 * static_cast<double>(r.size.width),
                    0.5 * static_cast<double>(r.size.height), static_cast<double>(r.angle));
    if (e.b >= 4.0 && e.a < gray.cols && Follows(contour, e)) ellipses.push_back(e);
  }
  return ellipses;
}

Segment MakeSegment(const cv::Vec4f& v) {
  return {Eigen::Vector2d(static_cast<double>(v[0]), static_cast<double>(v[1])),
          Eigen::Vector2d(static_cast<double>(v[2]), static_cast<double>(v[3]))};
}

std::vector<Segment> LsdSegments(const cv::Mat& gray) {
  std::vector<cv::Vec4f> lines;
  cv::createLineSegmentDetector()->detect(gray, lines);
  std::vector<Segment> segments;
  for (const cv::Vec4f& v : lines) segments.push_back(MakeSegment(v));
  return segments;
}

#ifdef CIRCLINE_HAVE_XIMGPROC
std::vector<Ellipse> EdgeDrawingEllipses(const cv::Mat& gray) {
  const auto drawing = cv::ximgproc::createEdgeDrawing();
  drawing->detectEdges(gray);
  std::vector<cv::Vec6d> found;  // Centre, radius of a circle or 0, axes, angle in degrees.
  drawing->detectEllipses(found);
  std::vector<Ellipse> ellipses;
  for (const cv::Vec6d& v : found) {
    ellipses.push_back(MakeEllipse(v[0], v[1], v[2] + v[3], v[2] + v[4], v[5]));
  }
  return ellipses;
}

std::vector<Segment> EdgeDrawingSegments(const cv::Mat& gray) {
  const auto drawing = cv::ximgproc::createEdgeDrawing();
  drawing->detectEdges(gray);
  std::vector<cv::Vec4f> lines;
  drawing->detectLines(lines);
  std::vector<Segment> segments;
  for (const cv::Vec4f& v : lines) segments.push_back(MakeSegment(v));
  return segments;
}
#endif

}  // namespace

std::vector<EllipseBaseline> EllipseBaselines() {
  return {
#ifdef CIRCLINE_HAVE_XIMGPROC
      {"EdgeDrawing", EdgeDrawingEllipses},
#endif
      {"Canny + fitEllipseDirect", CannyEllipses}};
}

std::vector<SegmentBaseline> SegmentBaselines() {
  return {
#ifdef CIRCLINE_HAVE_XIMGPROC
      {"EdgeDrawing", EdgeDrawingSegments},
#endif
      {"LineSegmentDetector", LsdSegments}};
}

}  // namespace circline::benchmark
