// The table of circline_robust_fit_benchmark: its chapters, and the rows that they print.
#ifndef CIRCLINE_APPS_BENCHMARK_ROBUST_FIT_TABLE_H_
#define CIRCLINE_APPS_BENCHMARK_ROBUST_FIT_TABLE_H_

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <functional>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "apps/benchmark/timing.h"

namespace circline::apps {

void RunConics();    // One ellipse among outliers of many kinds.
void RunContours();  // The same through FitObservations, and what only that decides.
void RunLines();
void RunPencils();  // Three orthogonal directions among clutter.

// What a row has to reach; 0 = no bar.
struct Bar {
  double ok_percent = 0.0, error = 0.0, ms = 0.0;
};

constexpr double kLost = 1e9;  // The error where nothing was found.

// Errors (over the bound) and times of one method on all data of a row.
class Tally {
 public:
  void Add(double error, double ms) {
    errors_.push_back(error);
    ms_.push_back(ms);
  }
  double OkPercent() const;  // Of errors of at most 3.
  double Error() const;      // Median.
  double Ms() const;         // Median.

 private:
  std::vector<double> errors_, ms_;
};

void PrintHead(const char* title, const char* error_name);
void PrintRow(const std::string& data, const std::string& method, const Tally& tally,
              const Bar& bar);
// "ok >= 100 met; error <= 1.05 NOT MET; "
std::string Verdict(const Bar& bar, double ok_percent, double error, double ms);

// A way to fit a model to a scene; false where it finds none.
template <typename Scene, typename Model>
struct Method {
  const char* name;
  std::function<bool(const Scene&, Model*)> fit;
  bool ours;  // Has to reach the bar.
};

// A row for each method.
template <typename Scene, typename Model>
void FitAndPrintRows(const std::string& data, const std::vector<Scene>& scenes,
                     const std::vector<Method<Scene, Model>>& methods, const Bar& bar) {
  for (const Method<Scene, Model>& method : methods) {
    Tally tally;
    for (const Scene& scene : scenes) {
      Model model;
      bool found = false;
      const double ms = Milliseconds([&] { found = method.fit(scene, &model); });
      const double error = found ? scene.Error(model) : kLost;
      tally.Add(std::isfinite(error) ? error : kLost, ms);
    }
    PrintRow(data, method.name, tally, method.ours ? bar : Bar());
  }
}

// For OpenCV's fits: the points that the mask (if any) keeps, and PinholeCamera() as a matrix.
std::vector<cv::Point2f> OpenCvPoints(const std::vector<Eigen::Vector2d>& pixels,
                                      const std::vector<std::uint8_t>* mask = nullptr);
Eigen::Matrix3d PixelFromX();

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_BENCHMARK_ROBUST_FIT_TABLE_H_
