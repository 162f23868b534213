#include "apps/benchmark/robust_fit_table.h"

#include <algorithm>
#include <cstdio>

#include "tests/pinhole_camera.h"

namespace circline::apps {

double Tally::OkPercent() const {
  constexpr double kOkError = 3.0;
  const auto ok =
      std::count_if(errors_.begin(), errors_.end(), [](double error) { return error <= kOkError; });
  return 100.0 * static_cast<double>(ok) / static_cast<double>(errors_.size());
}

double Tally::Error() const { return Quantile(errors_, 0.5); }

double Tally::Ms() const { return Quantile(ms_, 0.5); }

void PrintHead(const char* title, const char* error_name) {
  std::printf("\n%s\n%-26s %-28s %6s %9s %9s  %s\n", title, "data", "method", "ok %", error_name,
              "ms", "bar");
}

std::string Verdict(const Bar& bar, double ok_percent, double error, double ms) {
  std::string verdict;
  char text[64];
  const auto check = [&](const char* name, double limit, double value, bool at_least) {
    if (limit <= 0.0) return;
    const bool met = at_least ? value >= limit : value <= limit;
    std::snprintf(text, sizeof(text), "%s %s %g %s; ", name, at_least ? ">=" : "<=", limit,
                  met ? "met" : "NOT MET");
    verdict += text;
  };
  check("ok", bar.ok_percent, ok_percent, true);
  check("error", bar.error, error, false);
  check("ms", bar.ms, ms, false);
  return verdict;
}

void PrintRow(const std::string& data, const std::string& method, const Tally& tally,
              const Bar& bar) {
  std::printf("%-26s %-28s %6.1f %9.2f %9.3f  %s\n", data.c_str(), method.c_str(),
              tally.OkPercent(), tally.Error(), tally.Ms(),
              Verdict(bar, tally.OkPercent(), tally.Error(), tally.Ms()).c_str());
  std::fflush(stdout);
}

std::vector<cv::Point2f> OpenCvPoints(const std::vector<Eigen::Vector2d>& pixels,
                                      const std::vector<std::uint8_t>* mask) {
  std::vector<cv::Point2f> points;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (mask != nullptr && (*mask)[i] == 0) continue;
    points.emplace_back(static_cast<float>(pixels[i].x()), static_cast<float>(pixels[i].y()));
  }
  return points;
}

Eigen::Matrix3d PixelFromX() {
  const Camera camera = PinholeCamera();
  Eigen::Matrix3d pixel_from_x;
  pixel_from_x << camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0;
  return pixel_from_x;
}

}  // namespace circline::apps
