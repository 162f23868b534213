// Three orthogonal vanishing points at once, as a model for RANSAC (a rotation; the "Manhattan
// frame" of streets and rooms). A line counts for the direction that it
// misses least; residuals are those of pencil_model.h.
#ifndef CIRCLINE_RANSAC_DIRECTION_MODELS_H_
#define CIRCLINE_RANSAC_DIRECTION_MODELS_H_

#include <Eigen/Core>
#include <array>

#include "circline/ransac/pencil_model.h"

namespace circline {

// Three orthogonal directions from three lines: two of one direction, and one of another.
class OrthogonalTripletModel {
 public:
  using Value = std::array<double, 9>;  // A rotation, column by column: the directions.
  static constexpr int kMinSamples = 3;
  // Of all-inlier samples of three evenly used directions, those with two lines of one first and
  // one of another last.
  static constexpr double kGoodSamples = 2.0 / 9.0;

  // `lines` outlives the model.
  explicit OrthogonalTripletModel(const PencilModel& lines) : lines_(lines) {}

  int NumData() const { return lines_.NumData(); }
  bool Fit(const int* sample, Value* rotation) const;
  void SquaredResiduals(const Value& rotation, int begin, int end, float* r2) const;
  bool Refine(const float* weights, Value* rotation) const;
  // Whether two of the directions have two lines each within the threshold.
  bool Accept(const Value& rotation, double threshold) const;

 private:
  const PencilModel& lines_;
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DIRECTION_MODELS_H_
