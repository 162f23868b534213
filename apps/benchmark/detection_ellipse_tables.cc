// Tables of ellipses: on renderings and on labelled photographs.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <map>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "apps/benchmark/baseline_detectors.h"
#include "apps/benchmark/detection_statistics.h"
#include "apps/benchmark/detection_tables.h"
#include "apps/benchmark/detection_truth.h"
#include "apps/benchmark/ellipse_overlap.h"
#include "circline/estimators/circle_pose.h"
#include "circline/estimators/conic.h"
#include "circline/ransac/detection/detect_ellipses.h"
#include "circline/ransac/detection/edges.h"

namespace circline::benchmark {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

std::vector<PolygonPoints> Polygons(const std::vector<Ellipse>& ellipses) {
  std::vector<PolygonPoints> polygons;
  for (const Ellipse& e : ellipses) polygons.push_back(EllipsePolygon(e));
  return polygons;
}

struct Timed {
  std::vector<DetectedEllipse> ellipses;
  std::vector<PolygonPoints> polygons;
  double edges_ms = 0.0, ellipses_ms = 0.0;
};

Timed RunEllipses(const cv::Mat& image, const Camera& camera) {
  Timed t;
  cv::Mat gray;
  if (!ToGray(image, &gray).ok()) return t;
  EdgeMap edges;
  std::clock_t start = std::clock();
  DetectEdges(gray, EdgeOptions(), &edges);
  t.edges_ms = Milliseconds(start);
  start = std::clock();
  EllipseOptions options;
  options.max_ellipses = 1000;
  DetectEllipses(edges, camera, options, &t.ellipses);
  t.ellipses_ms = Milliseconds(start);
  for (const DetectedEllipse& e : t.ellipses)
    t.polygons.push_back(ContourPolygon(camera, e.fit.conic));
  return t;
}

// The truth of the renderings lists no rim with a shorter semi-minor axis than this, though some
// are drawn and their photographs of textures hold blobs of that size.
constexpr double kSmallestListedPx = 8.0;

// OpenCV's detectors on the renderings.
void MeasureEllipseBaselines(const std::string& folder,
                             const std::map<std::string, RenderedImage>& images) {
  for (const EllipseBaseline& baseline : EllipseBaselines()) {
    Score score;
    std::vector<double> ms;
    for (const auto& [name, truth] : images) {
      const cv::Mat image = cv::imread(folder + "/" + name, cv::IMREAD_GRAYSCALE);
      if (image.empty()) continue;
      const std::clock_t start = std::clock();
      const std::vector<Ellipse> found = baseline.detect(image);
      ms.push_back(Milliseconds(start));
      std::vector<PolygonPoints> polygons;
      for (const Ellipse& e : found) {
        if (e.b >= kSmallestListedPx) polygons.push_back(EllipsePolygon(e));
      }
      std::vector<double> overlap;
      Match(Polygons(truth.ellipses), polygons, &overlap);
      score.Add(overlap, polygons.size());
    }
    std::printf("  %-24s %4d %5d   %.3f   %.3f   ms median %.1f worst %.1f\n",
                baseline.name.c_str(), score.truth, score.found, score.F(score.hit80),
                score.F(score.hit95), Quantile(ms, 0.5), Quantile(ms, 1.0));
  }
}

}  // namespace

double BetterNormalDeg(const Matrix3d& conic, const Vector3d& normal) {
  std::array<CirclePose, 2> poses;
  const int n = CirclePoses(conic, &poses);
  double best = 180.0;
  for (int k = 0; k < n; ++k) {
    const double c = std::abs(poses[static_cast<std::size_t>(k)].normal.dot(normal));
    best = std::min(best, kDegrees * std::acos(std::min(1.0, c)));
  }
  return best;
}

void MeasureRenderings(const std::string& folder) {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 800.0;
  camera.cx = 320.0;
  camera.cy = 240.0;
  std::array<Score, 5> scores;
  Score listed;
  double smallest_px = 1e9;
  std::array<std::vector<double>, 5> errors;
  std::vector<double> edges_ms, ellipses_ms, both_ms;
  const std::map<std::string, RenderedImage> images = ReadRenderings(folder + "/truth.csv");
  for (const auto& [name, truth] : images) {
    const cv::Mat image = cv::imread(folder + "/" + name, cv::IMREAD_GRAYSCALE);
    if (image.empty()) continue;
    const std::vector<PolygonPoints> polygons = Polygons(truth.ellipses);
    for (const Ellipse& e : truth.ellipses) smallest_px = std::min(smallest_px, e.b);
    const Timed t = RunEllipses(image, camera);
    edges_ms.push_back(t.edges_ms);
    ellipses_ms.push_back(t.ellipses_ms);
    both_ms.push_back(t.edges_ms + t.ellipses_ms);
    std::vector<double> overlap;
    const std::vector<int> partner = Match(polygons, t.polygons, &overlap);
    std::vector<PolygonPoints> large;
    for (const PolygonPoints& polygon : t.polygons) {
      if (SemiMinorPx(polygon) >= kSmallestListedPx) large.push_back(polygon);
    }
    std::vector<double> overlap_large;
    Match(polygons, large, &overlap_large);
    listed.Add(overlap_large, large.size());
    for (const int group : {truth.group, 4}) {
      const auto g = static_cast<std::size_t>(group);
      scores[g].Add(overlap, t.polygons.size());
      for (std::size_t k = 0; k < partner.size(); ++k) {
        if (overlap[k] < 0.8) continue;
        const auto f = static_cast<std::size_t>(partner[k]);
        errors[g].push_back(BetterNormalDeg(t.ellipses[f].fit.conic, truth.normals[k]));
      }
    }
  }
  std::printf("renderings %s\n  group  truth found  F(0.8) F(0.95)  normal deg: median  90%%\n",
              folder.c_str());
  const std::array<const char*, 5> names = {"plain", "textured", "occluded", "noisy", "all"};
  for (std::size_t g = 0; g < 5; ++g) {
    const Score& s = scores[g];
    std::printf("  %-9s %4d %5d   %.3f   %.3f   %17.3f %5.3f\n", names[g], s.truth, s.found,
                s.F(s.hit80), s.F(s.hit95), Quantile(errors[g], 0.5), Quantile(errors[g], 0.9));
  }
  std::printf(
      "  of %.0f px and more (the smallest that the truth lists has a semi-axis of %.2f px):\n",
      kSmallestListedPx, smallest_px);
  std::printf("  %-24s %4d %5d   %.3f   %.3f\n", "circline", listed.truth, listed.found,
              listed.F(listed.hit80), listed.F(listed.hit95));
  MeasureEllipseBaselines(folder, images);
  std::printf(
      "  ms: edges median %.1f worst %.1f, ellipses besides %.1f %.1f, both together %.1f %.1f\n",
      Quantile(edges_ms, 0.5), Quantile(edges_ms, 1.0), Quantile(ellipses_ms, 0.5),
      Quantile(ellipses_ms, 1.0), Quantile(both_ms, 0.5), Quantile(both_ms, 1.0));
}

void MeasureLabels(const std::string& folder, const cv::FileNode& root) {
  Score all;
  std::vector<double> ms;
  std::printf(
      "labelled ellipses %s\n  photo            labels found  recall(0.8) (0.95)   ms: edges "
      "ellipses besides\n",
      folder.c_str());
  for (const cv::FileNode& node : root["images"]) {
    const std::string file = ReadText(node, "file");
    const cv::Mat image = cv::imread(folder + "/" + file, cv::IMREAD_COLOR);
    if (image.empty()) continue;
    Camera camera;  // Not calibrated: any pinhole does for finding ellipses.
    camera.width = image.cols;
    camera.height = image.rows;
    camera.fx = camera.fy = image.cols;
    camera.cx = 0.5 * (image.cols - 1);
    camera.cy = 0.5 * (image.rows - 1);
    const Timed t = RunEllipses(image, camera);
    ms.push_back(t.edges_ms + t.ellipses_ms);
    std::vector<PolygonPoints> truth;
    for (const cv::FileNode& label : node["ellipses"]) {
      const Ellipse ellipse = ReadEllipse(ReadMatrix(label, "ellipse"));
      if (2.0 * ellipse.a >= 20.0) truth.push_back(EllipsePolygon(ellipse));
    }
    std::vector<double> overlap;
    Match(truth, t.polygons, &overlap);
    Score s;
    s.Add(overlap, t.polygons.size());
    all.Add(overlap, t.polygons.size());
    std::printf("  %-16s %5d %5d   %8.3f  %8.3f  %9.1f %.1f\n", file.c_str(), s.truth, s.found,
                static_cast<double>(s.hit80) / std::max(1, s.truth),
                static_cast<double>(s.hit95) / std::max(1, s.truth), t.edges_ms, t.ellipses_ms);
  }
  std::printf("  all %18d %5d   %8.3f  %8.3f   ms with edges: median %.1f worst %.1f\n", all.truth,
              all.found, static_cast<double>(all.hit80) / std::max(1, all.truth),
              static_cast<double>(all.hit95) / std::max(1, all.truth), Quantile(ms, 0.5),
              Quantile(ms, 1.0));
}

}  // namespace circline::benchmark
