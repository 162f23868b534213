// OpenCV's own detectors, to be measured in the same run as ours.
#ifndef CIRCLINE_APPS_BENCHMARK_BASELINE_DETECTORS_H_
#define CIRCLINE_APPS_BENCHMARK_BASELINE_DETECTORS_H_

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "circline/estimators/conic.h"
#include "circline/estimators/observations.h"

namespace circline::benchmark {

struct EllipseBaseline {
  std::string name;
  std::vector<Ellipse> (*detect)(const cv::Mat& gray);  // Pixels of the photo.
};

struct SegmentBaseline {
  std::string name;
  std::vector<Segment> (*detect)(const cv::Mat& gray);
};

// What this OpenCV has: contours of Canny's edges through fitEllipseDirect and the
// LineSegmentDetector; with its ximgproc module, EdgeDrawing's ellipses and lines.
std::vector<EllipseBaseline> EllipseBaselines();
std::vector<SegmentBaseline> SegmentBaselines();

}  // namespace circline::benchmark

#endif  // CIRCLINE_APPS_BENCHMARK_BASELINE_DETECTORS_H_
