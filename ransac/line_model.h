// Robust line through points: two points a sample, distances in pixels of the photo.
#ifndef CIRCLINE_RANSAC_LINE_MODEL_H_
#define CIRCLINE_RANSAC_LINE_MODEL_H_

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/export.h"
#include "circline/estimators/line.h"
#include "circline/estimators/status.h"
#include "circline/ransac/ransac.h"

namespace CIRCLINE_EXPORT circline {

// The line that most of the points support, as a maximum-likelihood fit of its inliers with
// covariance; options.ransac.threshold in pixels of the photo. `mask` (optional) receives one value
// per point, 1 where the returned line passes within the threshold. Two points are fitted as they
// are. Refuses fewer than two points, and points that all coincide. `fit` and `mask` are written
// only if the status is ok.
Status FitLineRobust(const std::vector<CalibratedPoint>& points, const RobustFitOptions& options,
                     LineFit* fit, std::vector<std::uint8_t>* mask = nullptr);

// The model for the engine. Coordinates are shifted and scaled so that the points fill [-1, 1].
class LineModel {
 public:
  using Value = std::array<double, 3>;   // a x + b y + c = 0, (a, b) of unit length.
  static constexpr int kMinSamples = 2;  // Points of a line.

  // Keeps a copy, in an order of its own.
  explicit LineModel(const std::vector<CalibratedPoint>& points);

  int NumData() const { return static_cast<int>(index_.size()); }  // All points.
  // Index into the constructor's points of the datum at position i.
  int PointIndex(int i) const { return index_[static_cast<std::size_t>(i)]; }
  // The line in calibrated coordinates, of unit length.
  Eigen::Vector3d ToLine(const Value& value) const;

  // As the engine asks for it (ransac.h).
  bool Fit(const int* sample, Value* value) const;
  void SquaredResiduals(const Value& value, int begin, int end, float* r2) const;
  bool Refine(const float* weights, Value* value) const;
  bool Accept(const Value& /*value*/, double /*threshold*/) const { return true; }

 private:
  std::vector<int> index_;
  std::vector<float> data_;  // x, y and the four entries of x_from_pixel: six flat arrays.
  std::vector<Eigen::Vector2d> x_;
  Eigen::Vector2d center_ = Eigen::Vector2d::Zero();
  double scale_ = 1.0;
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_LINE_MODEL_H_
