// The cost function of a box's edges.
#ifndef CIRCLINE_APPS_RECONSTRUCT_BOX_EDGE_COST_H_
#define CIRCLINE_APPS_RECONSTRUCT_BOX_EDGE_COST_H_

#include <array>
#include <vector>

#include "circline/refine/cost_functions.h"

namespace circline::apps {

// Edge of a box: rotation, translation, length x (1), length y (1), length z (1), skew (3),
// [camera]. A corner of the box is the world's origin, its edges run along the axes. `axis` (0, 1,
// 2): along which this one runs; far[k]: whether it lies at the far end of the box along axis k
// (that of `axis` itself has no meaning). `skew`: by how much the corner's angles (yz), (zx), (xy)
// are below a right angle, radians, half of it at either edge; cartons lean (NewGaussianPrior).
class BoxEdgeCost : public CurveCost {
 public:
  // Of the points along it.
  BoxEdgeCost(ImagePoints points, int axis, const std::array<bool, 3>& far, bool camera = false);
  bool EvaluateWith(const Weighing& weighing, const double* const* parameters, double* residuals,
                    double** jacobians) const override;
  void Distances(const double* const* parameters, std::vector<double>* distances) const override;

 private:
  struct Placed;

  int axis_;
  std::array<bool, 3> far_;
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_BOX_EDGE_COST_H_
