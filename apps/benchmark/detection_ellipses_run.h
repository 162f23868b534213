// The detection of ellipses that the tables measure.
#ifndef CIRCLINE_APPS_BENCHMARK_DETECTION_ELLIPSES_RUN_H_
#define CIRCLINE_APPS_BENCHMARK_DETECTION_ELLIPSES_RUN_H_

#include <opencv2/core.hpp>
#include <vector>

#include "apps/benchmark/ellipse_overlap.h"
#include "circline/estimators/camera.h"
#include "circline/ransac/detection/detect_ellipses.h"

namespace circline::benchmark {

struct Timed {
  std::vector<DetectedEllipse> ellipses;
  std::vector<PolygonPoints> polygons;
  double edges_ms = 0.0, ellipses_ms = 0.0;
};

// All ellipses of a photo.
Timed RunEllipses(const cv::Mat& image, const Camera& camera);

}  // namespace circline::benchmark

#endif  // CIRCLINE_APPS_BENCHMARK_DETECTION_ELLIPSES_RUN_H_
