// The model of a vanishing point for the engine: the direction that lines share.
//
// A line misses a direction by l . v radians. Its residual is that in standard deviations,
//   r = l . v / sqrt(v^T Cov(l) v + model_sigma_rad^2),
// so that long, well-measured segments are held to account more strictly than short ones, and
// directions at infinity in the image are nothing special.
#ifndef CIRCLINE_RANSAC_PENCIL_MODEL_H_
#define CIRCLINE_RANSAC_PENCIL_MODEL_H_

#include <Eigen/Core>
#include <array>
#include <vector>

#include "circline/estimators/export.h"
#include "circline/estimators/line.h"

namespace CIRCLINE_EXPORT circline {

// Lines at a smaller angle are one line, radians: far below any noise, far above rounding.
constexpr double kCoincidentRad = 1e-9;

// The model for the engine: directions from two lines.
class PencilModel {
 public:
  using Value = std::array<double, 3>;   // Unit direction.
  static constexpr int kMinSamples = 2;  // Lines of a vanishing point.

  // Takes lines[indices[k]] for all k, in an order of its own.
  PencilModel(const std::vector<LineFit>& lines, const std::vector<int>& indices,
              double model_sigma_rad);

  int NumData() const { return static_cast<int>(index_.size()); }  // Lines that were taken.
  // Index into `lines` of the datum at position i.
  int LineIndex(int i) const { return index_[static_cast<std::size_t>(i)]; }

  // Unit line at position i, and the variance of its product with a direction (model's error too).
  const Eigen::Vector3d& Line(int i) const { return lines_[static_cast<std::size_t>(i)]; }
  double Variance(const Eigen::Vector3d& direction, int i) const;

  // As the engine asks for it (ransac.h).
  bool Fit(const int* sample, Value* direction) const;
  void SquaredResiduals(const Value& direction, int begin, int end, float* r2) const;
  bool Refine(const float* weights, Value* direction) const;
  bool Accept(const Value& /*direction*/, double /*threshold*/) const { return true; }

 private:
  std::vector<int> index_;
  // Lines, and covariance as p p^T + q q^T: nine flat arrays of num_data each.
  std::vector<float> data_;
  std::vector<Eigen::Vector3d> lines_;
  float model_variance_;
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_PENCIL_MODEL_H_
