// How the cost functions of lines write their residuals. Internal: not installed.
#ifndef CIRCLINE_REFINE_LINE_ROOT_H_
#define CIRCLINE_REFINE_LINE_ROOT_H_

#include <algorithm>

#include "circline/refine/image_points.h"
#include "circline/refine/square_root.h"

namespace circline {

using LineRoot = SquareRoot<CurveModel::kMaxSize>;

// A variable lens can do what no line can; the camera's other shifts cannot, but for what the lens
// bends.
inline int LineRank(const ImagePoints& points, bool camera) {
  return 2 + (camera ? points.options().num_distortion : 0);
}

inline LineRoot WriteLine(const CurveModel& model, int rank, int num_rows, double* residuals) {
  const LineRoot root = SquareRootOf<CurveModel::kMaxSize>(model, rank, 3, 2);
  std::fill(residuals, residuals + num_rows, 0.0);
  Eigen::Map<Eigen::VectorXd>(residuals, root.f.size()) = root.f;
  residuals[num_rows - 1] = root.rest;
  return root;
}

}  // namespace circline

#endif  // CIRCLINE_REFINE_LINE_ROOT_H_
