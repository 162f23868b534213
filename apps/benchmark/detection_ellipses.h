// The ellipses of a photo as the tables measure them, and which of them are which of the truth: by
// the overlap of their areas.
#ifndef CIRCLINE_APPS_BENCHMARK_DETECTION_ELLIPSES_H_
#define CIRCLINE_APPS_BENCHMARK_DETECTION_ELLIPSES_H_

#include <Eigen/Core>
#include <algorithm>
#include <opencv2/core.hpp>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/conic.h"
#include "circline/ransac/detection/ellipses/detect_ellipses.h"

namespace circline::apps {

using PolygonPoints = std::vector<cv::Point2f>;

struct FoundEllipses {
  std::vector<DetectedEllipse> ellipses;
  std::vector<PolygonPoints> polygons;  // Their contours.
  double edges_ms = 0.0, ellipses_ms = 0.0;
};

// All ellipses of a photo.
FoundEllipses FindEllipses(const cv::Mat& image, const Camera& camera);

PolygonPoints EllipsePolygon(const Ellipse& e);

// Contour of a calibrated ellipse on the photo.
PolygonPoints ContourPolygon(const Camera& camera, const Eigen::Matrix3d& conic);

double IntersectionOverUnion(const PolygonPoints& a, const PolygonPoints& b);

// Best partner of each truth, each detection used once, nearest first.
std::vector<int> Match(const std::vector<PolygonPoints>& truth,
                       const std::vector<PolygonPoints>& found, std::vector<double>* overlap);

// Semi-minor axis of the contour of an ellipse on the photo, pixels.
double SemiMinorPx(const PolygonPoints& polygon);

// Counts over a set.
struct Score {
  int truth = 0, found = 0, hit80 = 0, hit95 = 0;

  void Add(const std::vector<double>& overlap, std::size_t num_found) {
    truth += static_cast<int>(overlap.size());
    found += static_cast<int>(num_found);
    for (const double o : overlap) {
      hit80 += o >= 0.8 ? 1 : 0;
      hit95 += o >= 0.95 ? 1 : 0;
    }
  }
  double Recall(int hits) const { return static_cast<double>(hits) / std::max(1, truth); }
  double F(int hits) const { return truth + found > 0 ? 2.0 * hits / (truth + found) : 0.0; }
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_BENCHMARK_DETECTION_ELLIPSES_H_
