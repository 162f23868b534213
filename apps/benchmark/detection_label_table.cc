// Table of labelled photographs.
#include <cstdio>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "apps/benchmark/detection_ellipses.h"
#include "apps/benchmark/detection_tables.h"
#include "apps/benchmark/detection_truth.h"
#include "apps/benchmark/timing.h"
#include "tests/pinhole_camera.h"

namespace circline::apps {

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
    // Not calibrated: any pinhole does for finding ellipses.
    const Camera camera = CenteredCamera(image.cols, image.cols, image.rows);
    const FoundEllipses t = FindEllipses(image, camera);
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
                s.Recall(s.hit80), s.Recall(s.hit95), t.edges_ms, t.ellipses_ms);
  }
  std::printf("  all %18d %5d   %8.3f  %8.3f   ms with edges: median %.1f worst %.1f\n", all.truth,
              all.found, all.Recall(all.hit80), all.Recall(all.hit95), Quantile(ms, 0.5),
              Quantile(ms, 1.0));
}

}  // namespace circline::apps
