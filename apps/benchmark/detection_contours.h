// How far edge points of circles lie from the conics that are true of them.
#ifndef CIRCLINE_APPS_BENCHMARK_DETECTION_CONTOURS_H_
#define CIRCLINE_APPS_BENCHMARK_DETECTION_CONTOURS_H_

#include <opencv2/core.hpp>
#include <set>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/observations.h"

namespace circline::benchmark {

// Collects, over the circles of a set that are found, root mean squares in pixels of the distances
// to the true conic, beside what the set records of edge points of its own.
class ContourResiduals {
 public:
  // `node` is a photo of the set's truth.
  void Add(const cv::FileNode& node, const Camera& camera, const Observations& found);

  // Medians; nothing where the set records none.
  void Print() const;

 private:
  void AddCircle(const cv::FileNode& circle, const Camera& camera, const Observations& found);
  void AddBeside(const cv::FileNode& circle, const Camera& camera, const Eigen::Matrix3d& conic,
                 const Eigen::Vector2d& center, const std::vector<Eigen::Vector2d>& points);

  std::vector<double> found_, recorded_;
  // Where every circle has a radius of its own, fitted to the edge points that the set records,
  // the truth has no size to compare with: residuals about their mean.
  std::vector<double> about_mean_;
  std::set<double> radii_;
  int circles_ = 0;
  // Where the set lists its edge points: these, and ours in the same directions from the centre.
  std::vector<double> listed_, beside_;
};

}  // namespace circline::benchmark

#endif  // CIRCLINE_APPS_BENCHMARK_DETECTION_CONTOURS_H_
