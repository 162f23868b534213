// The table of segments on the edges of chessboards.
#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>
#ifdef CIRCLINE_HAVE_XIMGPROC
#include <opencv2/ximgproc/edge_drawing.hpp>
#endif

#include "apps/benchmark/detection_tables.h"
#include "apps/benchmark/detection_truth.h"
#include "apps/benchmark/timing.h"
#include "circline/estimators/line.h"
#include "circline/ransac/detection/detect_observations.h"
#include "circline/ransac/detection/edges.h"
#include "circline/ransac/detection/lines/detect_lines.h"

namespace circline::apps {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// OpenCV's own detectors, in the same run as ours.
std::vector<Segment> FromOpenCv(const std::vector<cv::Vec4f>& lines) {
  std::vector<Segment> segments;
  for (const cv::Vec4f& v : lines) {
    const Eigen::Vector4d ends = Eigen::Vector4f(v.val).cast<double>();
    segments.push_back({ends.head<2>(), ends.tail<2>()});
  }
  return segments;
}

std::vector<Segment> LsdSegments(const cv::Mat& gray) {
  std::vector<cv::Vec4f> lines;
  cv::createLineSegmentDetector()->detect(gray, lines);
  return FromOpenCv(lines);
}

#ifdef CIRCLINE_HAVE_XIMGPROC
std::vector<Segment> EdgeDrawingSegments(const cv::Mat& gray) {
  const auto drawing = cv::ximgproc::createEdgeDrawing();
  drawing->detectEdges(gray);
  std::vector<cv::Vec4f> lines;
  drawing->detectLines(lines);
  return FromOpenCv(lines);
}
#endif

struct Detector {
  const char* name;
  std::vector<Segment> (*detect)(const cv::Mat& gray);
};
constexpr Detector kOpenCvDetectors[] = {
#ifdef CIRCLINE_HAVE_XIMGPROC
    {"EdgeDrawing", EdgeDrawingSegments},
#endif
    {"LineSegmentDetector", LsdSegments}};

// What one detector has found.
struct Ends {
  std::string name;
  std::vector<double> squares, ms;  // Squared distances of ends to the board's lines.
};

// A row or column of a chessboard's corners: its line, and how far it reaches.
struct BoardLine {
  Vector3d line;
  Segment ends;
};

// Of a board of 9 x 6 corners, given row by row.
std::vector<BoardLine> BoardLines(const cv::FileNode& node, const Camera& camera) {
  constexpr int kColumns = 9, kRows = 6;
  std::vector<BoardLine> lines;
  const cv::Mat corners = ReadMatrix(node, "corners");
  if (corners.rows != kColumns * kRows || !node["corner_ids"].empty()) return lines;
  const auto add = [&](int first, int step, int count) {
    std::vector<CalibratedPoint> points;
    BoardLine line;
    for (int k = 0; k < count; ++k) {
      const int i = first + k * step;
      const Vector2d pixel(corners.at<double>(i, 0), corners.at<double>(i, 1));
      CalibratedPoint p;
      if (!PixelToCalibrated(camera, pixel, &p)) continue;
      points.push_back(p);
      if (k == 0) line.ends[0] = pixel;
      line.ends[1] = pixel;
    }
    LineFit fit;
    if (!FitLine(points, 1.0, &fit).ok()) return;
    line.line = fit.line;
    lines.push_back(line);
  };
  for (int row = 0; row < kRows; ++row) add(row * kColumns, 1, kColumns);
  for (int column = 0; column < kColumns; ++column) add(column, kColumns, kRows);
  return lines;
}

// Adds the squared distances of both ends of every segment that runs along one of the lines.
void AddEndResiduals(const std::vector<BoardLine>& lines, const Camera& camera,
                     const std::vector<Segment>& segments, std::vector<double>* squares) {
  constexpr double kAlongPx = 2.0, kMinLengthPx = 20.0;
  for (const Segment& segment : segments) {
    if ((segment[1] - segment[0]).norm() < kMinLengthPx) continue;
    for (const BoardLine& line : lines) {
      const Vector2d along = line.ends[1] - line.ends[0];
      std::array<double, 2> distance;
      bool belongs = true;
      for (std::size_t k = 0; k < 2; ++k) {
        CalibratedPoint p;
        const double t = along.dot(segment[k] - line.ends[0]) / along.squaredNorm();
        belongs = belongs && t > -0.2 && t < 1.2 && PixelToCalibrated(camera, segment[k], &p);
        if (!belongs) break;
        distance[k] = LineDistancePx(p, line.line);
        belongs = std::abs(distance[k]) < kAlongPx;
      }
      if (!belongs) continue;
      for (const double d : distance) squares->push_back(d * d);
      break;
    }
  }
}

// The ends of a detected line as its fit has them: moved across onto it.
Segment FittedEnds(const DetectedLine& line, const Camera& camera) {
  Segment ends = line.ends;
  for (Vector2d& end : ends) {
    CalibratedPoint p;
    if (!PixelToCalibrated(camera, end, &p)) continue;
    const Vector2d across = p.GradientPerPixel(line.fit.line.head<2>()).normalized();
    end -= LineDistancePx(p, line.fit.line) * across;
  }
  return ends;
}

void Print(const Ends& ends) {
  double sum = 0.0;
  for (const double s : ends.squares) sum += s;
  std::printf(
      "  segments, %-22s %6d ends, rms to the board's lines %.3f px, median %.3f; ms with edges "
      "%.1f\n",
      ends.name.c_str(), static_cast<int>(ends.squares.size()),
      std::sqrt(sum / static_cast<double>(ends.squares.size())),
      std::sqrt(Quantile(ends.squares, 0.5)), Quantile(ends.ms, 0.5));
}

}  // namespace

void MeasureSegments(const std::string& folder, const cv::FileNode& root) {
  std::vector<Ends> all = {{"circline", {}, {}}};
  for (const Detector& detector : kOpenCvDetectors) all.push_back({detector.name, {}, {}});
  for (const cv::FileNode& node : root["images"]) {
    const cv::Mat gray = cv::imread(folder + "/" + ReadText(node, "file"), cv::IMREAD_GRAYSCALE);
    Camera camera;
    if (gray.empty() || !CameraOf(root, node, gray.size(), &camera)) continue;
    const std::vector<BoardLine> lines = BoardLines(node, camera);
    if (lines.empty()) continue;
    std::vector<DetectedLine> found;
    all[0].ms.push_back(Milliseconds([&] {
      const EdgeMap edges = DetectEdges(gray);
      found = DetectLines(edges, camera, DetectionOptions().min_segment_length_px);
    }));
    std::vector<Segment> segments;
    for (const DetectedLine& line : found) segments.push_back(FittedEnds(line, camera));
    AddEndResiduals(lines, camera, segments, &all[0].squares);
    for (std::size_t k = 1; k < all.size(); ++k) {
      all[k].ms.push_back(Milliseconds([&] { segments = kOpenCvDetectors[k - 1].detect(gray); }));
      AddEndResiduals(lines, camera, segments, &all[k].squares);
    }
  }
  if (all[0].squares.empty()) return;
  for (const Ends& ends : all) Print(ends);
}

}  // namespace circline::apps
