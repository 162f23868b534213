#include "apps/benchmark/detection_ellipses.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "apps/benchmark/timing.h"
#include "circline/estimators/basics.h"
#include "circline/ransac/detection/detect_observations.h"
#include "circline/ransac/detection/edges.h"

namespace circline::apps {

using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

namespace {

double Cross(const cv::Point2f& a, const cv::Point2f& b) {
  return static_cast<double>(a.x) * static_cast<double>(b.y) -
         static_cast<double>(a.y) * static_cast<double>(b.x);
}

// Of two convex polygons of the same sense: the first is cut along the sides of the second
// (Sutherland and Hodgman, Reentrant polygon clipping, CACM 1974). cv::intersectConvexConvex of
// OpenCV 4.6 finds nothing in common of some that nearly coincide.
double CommonArea(PolygonPoints polygon, const PolygonPoints& other) {
  const double sense = cv::contourArea(other, true) < 0.0 ? -1.0 : 1.0;
  for (std::size_t k = 0; k < other.size(); ++k) {
    const cv::Point2f from = other[k], along = other[(k + 1) % other.size()] - from;
    PolygonPoints cut;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const cv::Point2f p = polygon[i], q = polygon[(i + 1) % polygon.size()];
      const double inside_p = sense * Cross(along, p - from);
      const double inside_q = sense * Cross(along, q - from);
      if (inside_p >= 0.0) cut.push_back(p);
      if (inside_p * inside_q < 0.0)
        cut.push_back(p + static_cast<float>(inside_p / (inside_p - inside_q)) * (q - p));
    }
    polygon = std::move(cut);
    if (polygon.empty()) return 0.0;
  }
  return cv::contourArea(polygon);
}

}  // namespace

FoundEllipses FindEllipses(const cv::Mat& image, const Camera& camera) {
  FoundEllipses found;
  cv::Mat gray;
  if (!ToGray(image, &gray).ok()) return found;
  EdgeMap edges;
  found.edges_ms = Milliseconds([&] { edges = DetectEdges(gray); });
  const DetectionOptions options;
  found.ellipses_ms = Milliseconds([&] {
    found.ellipses =
        DetectEllipses(edges, camera, {options.min_ellipse_axis_px, options.min_arc_deg});
  });
  for (const DetectedEllipse& e : found.ellipses)
    found.polygons.push_back(ContourPolygon(camera, e.fit.conic));
  return found;
}

PolygonPoints EllipsePolygon(const Ellipse& e) {
  PolygonPoints polygon;
  for (int k = 0; k < 128; ++k) {
    const Vector2d p = EllipsePoint(e, 2.0 * kPi * k / 128);
    polygon.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()));
  }
  return polygon;
}

PolygonPoints ContourPolygon(const Camera& camera, const Matrix3d& conic) {
  PolygonPoints polygon;
  Ellipse e;
  if (!ConicToEllipse(conic, &e)) return polygon;
  for (int k = 0; k < 128; ++k) {
    const Vector2d x = EllipsePoint(e, 2.0 * kPi * k / 128);
    Vector2d p;
    if (!CameraToPixel(camera, Vector3d(x.x(), x.y(), 1.0), &p)) return {};
    polygon.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()));
  }
  return polygon;
}

double IntersectionOverUnion(const PolygonPoints& a, const PolygonPoints& b) {
  if (a.empty() || b.empty()) return 0.0;
  const double area_a = cv::contourArea(a), area_b = cv::contourArea(b);
  const double both = CommonArea(a, b);
  return both / (area_a + area_b - both);
}

std::vector<int> Match(const std::vector<PolygonPoints>& truth,
                       const std::vector<PolygonPoints>& found, std::vector<double>* overlap) {
  struct Pair {
    double overlap;
    int truth, found;
  };
  std::vector<Pair> pairs;
  for (std::size_t t = 0; t < truth.size(); ++t) {
    for (std::size_t f = 0; f < found.size(); ++f) {
      const double o = IntersectionOverUnion(truth[t], found[f]);
      if (o > 0.5) pairs.push_back({o, static_cast<int>(t), static_cast<int>(f)});
    }
  }
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& a, const Pair& b) { return a.overlap > b.overlap; });
  std::vector<int> partner(truth.size(), -1), used(found.size(), 0);
  overlap->assign(truth.size(), 0.0);
  for (const Pair& p : pairs) {
    const auto t = static_cast<std::size_t>(p.truth), f = static_cast<std::size_t>(p.found);
    if (partner[t] >= 0 || used[f]) continue;
    partner[t] = p.found;
    used[f] = 1;
    (*overlap)[t] = p.overlap;
  }
  return partner;
}

double SemiMinorPx(const PolygonPoints& polygon) {
  if (polygon.size() < 5) return 0.0;
  const cv::RotatedRect box = cv::fitEllipse(polygon);
  return 0.5 * static_cast<double>(std::min(box.size.width, box.size.height));
}

}  // namespace circline::apps
