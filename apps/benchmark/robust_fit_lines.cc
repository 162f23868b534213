// Lines.
#include <opencv2/imgproc.hpp>
#include <vector>

#include "apps/benchmark/robust_fit_options.h"
#include "apps/benchmark/robust_fit_scenes.h"
#include "apps/benchmark/robust_fit_table.h"
#include "circline/ransac/line_model.h"

namespace circline::apps {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

bool OpenCvLine(const LineScene& scene, int distance, Vector3d* line) {
  cv::Vec4f fit;
  cv::fitLine(OpenCvPoints(scene.pixels), fit, distance, 0.0, 0.01, 0.01);
  const Vector2d direction(static_cast<double>(fit[0]), static_cast<double>(fit[1]));
  const Vector2d point(static_cast<double>(fit[2]), static_cast<double>(fit[3]));
  const Vector2d normal(-direction.y(), direction.x());
  const Vector3d in_pixels(normal.x(), normal.y(), -normal.dot(point));
  *line = (PixelFromX().transpose() * in_pixels).normalized();
  return true;
}

bool OurLine(const LineScene& scene, Vector3d* line) {
  LineFit fit;
  if (!FitLineRobust(scene.points, PixelOptions(), &fit).ok()) return false;
  *line = fit.line;
  return true;
}

void RunLineRow(const char* name, double outlier_ratio, const Bar& bar) {
  if (!Wanted(name)) return;
  std::vector<LineScene> scenes;
  for (int trial = 0; trial < FLAGS_trials; ++trial)
    scenes.push_back(MakeLineScene(outlier_ratio, FLAGS_sigma_px, TrialSeed(trial)));
  std::vector<Method<LineScene, Vector3d>> methods;
  if (FLAGS_peers) {
    const auto open_cv = [](int distance) {
      return [distance](const LineScene& s, Vector3d* l) { return OpenCvLine(s, distance, l); };
    };
    methods.push_back({"fitLine, Huber", open_cv(cv::DIST_HUBER), false});
    methods.push_back({"fitLine, Welsch", open_cv(cv::DIST_WELSCH), false});
  }
  methods.push_back({"ours", OurLine, true});
  FitAndPrintRows(name, scenes, methods, bar);
}

}  // namespace

void RunLines() {
  PrintHead("Lines: 100 points along 300 px, uniform outliers", "median C");
  RunLineRow("line, 50 %", 0.5, {100.0, 1.05, 0.05});
  RunLineRow("line, 70 %", 0.7, {100.0, 1.10, 0.05});
}

}  // namespace circline::apps
