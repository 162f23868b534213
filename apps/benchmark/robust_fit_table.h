// The rows that circline_robust_fit_benchmark prints.
#ifndef CIRCLINE_APPS_BENCHMARK_ROBUST_FIT_TABLE_H_
#define CIRCLINE_APPS_BENCHMARK_ROBUST_FIT_TABLE_H_

#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "circline/estimators/camera.h"

namespace circline::apps {

// What a row has to reach; 0 = no bar.
struct Bar {
  double ok_percent = 0.0, error = 0.0, ms = 0.0;
};

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

// For OpenCV's fits: the points that the mask (if any) keeps, and a camera as a matrix.
std::vector<cv::Point2f> OpenCvPoints(const std::vector<Eigen::Vector2d>& pixels,
                                      const std::vector<std::uint8_t>* mask = nullptr);
Eigen::Matrix3d PixelFromX(const Camera& camera);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_BENCHMARK_ROBUST_FIT_TABLE_H_
