#include "apps/benchmark/detection_ellipses_run.h"

#include <ctime>

#include "apps/benchmark/detection_statistics.h"
#include "circline/ransac/detection/edges.h"

namespace circline::benchmark {

Timed RunEllipses(const cv::Mat& image, const Camera& camera) {
  Timed t;
  cv::Mat gray;
  if (!ToGray(image, &gray).ok()) return t;
  EdgeMap edges;
  std::clock_t start = std::clock();
  DetectEdges(gray, EdgeOptions(), &edges);
  t.edges_ms = Milliseconds(start);
  start = std::clock();
  DetectEllipses(edges, camera, EllipseOptions(), &t.ellipses);
  t.ellipses_ms = Milliseconds(start);
  for (const DetectedEllipse& e : t.ellipses)
    t.polygons.push_back(ContourPolygon(camera, e.fit.conic));
  return t;
}

}  // namespace circline::benchmark
