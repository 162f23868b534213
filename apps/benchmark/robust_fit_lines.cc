// Lines.
#include <functional>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "apps/benchmark/robust_fit_options.h"
#include "apps/benchmark/robust_fit_rows.h"
#include "apps/benchmark/robust_fit_scenes.h"
#include "apps/benchmark/robust_fit_table.h"
#include "apps/benchmark/timing.h"
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
  *line = (PixelFromX(SceneCamera()).transpose() * in_pixels).normalized();
  return true;
}

bool OurLine(const LineScene& scene, Vector3d* line) {
  LineFit fit;
  if (!FitLineRobust(scene.points, PixelOptions(), &fit).ok()) return false;
  *line = fit.line;
  return true;
}

void RunLineRow(const std::string& name, double outlier_ratio, const Bar& bar) {
  struct Method {
    const char* name;
    std::function<bool(const LineScene&, Vector3d*)> fit;
    bool ours;
  };
  std::vector<Method> methods;
  if (FLAGS_peers) {
    const auto open_cv = [](int distance) {
      return [distance](const LineScene& s, Vector3d* l) { return OpenCvLine(s, distance, l); };
    };
    methods.push_back({"fitLine, Huber", open_cv(cv::DIST_HUBER), false});
    methods.push_back({"fitLine, Welsch", open_cv(cv::DIST_WELSCH), false});
  }
  methods.push_back({"ours", OurLine, true});
  for (const Method& method : methods) {
    Tally tally;
    for (int trial = 0; trial < FLAGS_trials; ++trial) {
      const LineScene scene = MakeLineScene(outlier_ratio, FLAGS_sigma_px, TrialSeed(trial));
      Vector3d line;
      bool found = false;
      const double ms = Milliseconds([&] { found = method.fit(scene, &line); });
      tally.Add(found ? scene.Error(line) : 1e9, ms);
    }
    PrintRow(name, method.name, tally, method.ours ? bar : Bar());
  }
}

}  // namespace

void RunLines() {
  PrintHead("Lines: 100 points along 300 px, uniform outliers", "median C");
  if (Wanted("line, 50 %")) RunLineRow("line, 50 %", 0.5, {100.0, 1.05, 0.05});
  if (Wanted("line, 70 %")) RunLineRow("line, 70 %", 0.7, {100.0, 1.10, 0.05});
}

}  // namespace circline::apps
