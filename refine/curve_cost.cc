// What the cost functions of contours and lines have in common: points about a curve.
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

#include "circline/refine/block_chain.h"
#include "circline/refine/cost_functions.h"
#include "circline/refine/square_root.h"

namespace circline {

CurveCost::CurveCost(ImagePoints points, int curve_rank, const std::vector<int>& sizes,
                     bool has_offset, bool has_camera, int num_priors)
    : points_(std::move(points)), curve_rank_(curve_rank), num_priors_(num_priors) {
  *mutable_parameter_block_sizes() = sizes;
  const auto add = [this](bool is_there, int size) {
    if (!is_there) return -1;
    mutable_parameter_block_sizes()->push_back(size);
    return static_cast<int>(parameter_block_sizes().size()) - 1;
  };
  offset_block_ = add(has_offset, 1);
  camera_block_ = add(has_camera, kCameraSize);
  set_num_residuals(Rank(has_camera) + 1 + num_priors_);
}

void CurveCost::ExchangePoints(ImagePoints* points) {
  std::swap(points_, *points);
  set_num_residuals(Rank(camera_block_ >= 0) + 1 + num_priors_);
}

// The offset can do what no curve can, and so can every shift of a camera that has a lens: a line
// through it is bent, by which straightness tells of the focal length, too. Those of a pinhole can
// not.
int CurveCost::Rank(bool camera_is_variable) const {
  constexpr int kWithoutLens = 4;  // Shifts that are not of distortion coefficients.
  const bool is_bent = camera_is_variable && points_.has_lens();
  return curve_rank_ + (offset_block_ >= 0 ? 1 : 0) +
         (is_bent ? kWithoutLens + points_.options().num_distortion : 0);
}

bool CurveCost::SumAbout(const Eigen::Ref<const Curve>& curve, const Weighing& weighing,
                         const double* const* parameters, double* residuals, double** jacobians,
                         Rows* U) const {
  // Only where somebody asks: a camera that is held has no derivatives.
  const ImagePoints::Variables variables{
      offset_block_ >= 0,
      camera_block_ >= 0 && jacobians != nullptr && jacobians[camera_block_] != nullptr};
  CurveModel model, *wanted = jacobians != nullptr ? &model : nullptr;
  const double* camera = CameraShifts(parameters);
  const double twice_cost =
      curve.cols() == 1
          ? points_.SumLine(curve.col(0), camera, weighing, variables.camera, wanted)
          : points_.SumConic(curve, Offset(parameters), camera, weighing, variables, wanted);
  if (!std::isfinite(twice_cost)) return false;
  const int rows = num_residuals() - num_priors_;
  if (jacobians == nullptr) {
    CostOnly(twice_cost, rows, residuals);
    return true;
  }
  const int curve_size = curve_rank_ + 1;  // Its scale has no meaning.
  const SquareRoot<CurveModel::kMaxSize> root(model.h, model.g, model.twice_cost,
                                              Rank(variables.camera));
  std::fill(residuals, residuals + rows, 0.0);
  Eigen::Map<Eigen::VectorXd>(residuals, root.f.size()) = root.f;
  residuals[rows - 1] = root.rest;
  int column = curve_size;
  if (variables.offset)
    WriteJacobian(root.U.col(column++), num_residuals(), offset_block_, jacobians);
  if (variables.camera)
    WriteJacobian(root.U.rightCols(root.U.cols() - column), num_residuals(), camera_block_,
                  jacobians, kCameraSize);
  *U = root.U.leftCols(curve_size);
  return true;
}

}  // namespace circline
