// What the cost functions share: parameter blocks one after the other, and derivatives by them.
// Internal: not installed.
#ifndef CIRCLINE_REFINE_BLOCK_CHAIN_H_
#define CIRCLINE_REFINE_BLOCK_CHAIN_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <limits>

#include "circline/estimators/pose.h"
#include "circline/refine/cost_functions.h"
#include "circline/refine/image_points.h"

namespace circline {

inline Eigen::Matrix3d RotationFromBlock(const double* q) {
  return Eigen::Map<const Eigen::Quaterniond>(q).normalized().toRotationMatrix();
}

// d delta / d quaternion for R exp([delta]x): twice the vector part of conj(q) dq.
inline Eigen::Matrix<double, 3, 4> DeltaFromQuaternion(const double* q) {
  const Eigen::Vector3d v(q[0], q[1], q[2]);
  Eigen::Matrix<double, 3, 4> G;
  G.leftCols<3>() = 2.0 * (q[3] * Eigen::Matrix3d::Identity() - CrossMatrix(v));
  G.col(3) = -2.0 * v;
  return G;
}

// Jacobians as ceres has them.
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

// jacobians[block] (num_residuals x size, row-major) = [J, 0; 0, 0], where ceres asks for it.
template <typename Derived>
void WriteJacobian(const Eigen::MatrixBase<Derived>& J, int num_residuals, int block,
                   double** jacobians, int size) {
  if (jacobians[block] == nullptr) return;
  Eigen::Map<RowMajor> out(jacobians[block], num_residuals, size);
  out.setZero();
  out.topLeftCorner(J.rows(), J.cols()) = J;
}
// The same for a block of J's size.
template <typename Derived>
void WriteJacobian(const Eigen::MatrixBase<Derived>& J, int num_residuals, int block,
                   double** jacobians) {
  WriteJacobian(J, num_residuals, block, jacobians, static_cast<int>(J.cols()));
}

// Sum of squared residuals, of a feature weighed so; infinite where they cannot be evaluated.
inline double TwiceCostOf(const ceres::CostFunction& cost, const FeatureCost* feature,
                          const Weighing& weighing, const double* const* parameters) {
  constexpr int kMaxResiduals = CurveModel::kMaxSize + 6;
  double residuals[kMaxResiduals], sum = 0.0;
  const bool evaluated = feature != nullptr
                             ? feature->EvaluateWith(weighing, parameters, residuals, nullptr)
                             : cost.Evaluate(parameters, residuals, nullptr);
  if (!evaluated) return std::numeric_limits<double>::infinity();
  for (int i = 0; i < cost.num_residuals(); ++i) sum += residuals[i] * residuals[i];
  return sum;
}

// A circle of the plane Z = 0 in the world: centre (2), radius and, where it is not null, its tilt
// and height (3), as PlaneCircleContourCost has them; its shape is left out.
struct PlaneCircle {
  Eigen::Vector3d center, normal;  // The latter of any length.
  double radius;

  PlaneCircle(const double* xy, double r, const double* tilt)
      : center(xy[0], xy[1], tilt != nullptr ? tilt[2] * r : 0.0),
        normal(tilt != nullptr ? tilt[0] : 0.0, tilt != nullptr ? tilt[1] : 0.0, 1.0),
        radius(r) {}
};

// Without derivatives the whole cost is one residual.
inline void CostOnly(double twice_cost, int num_residuals, double* residuals) {
  std::fill(residuals, residuals + num_residuals, 0.0);
  residuals[num_residuals - 1] = std::sqrt(std::max(0.0, twice_cost));
}

}  // namespace circline

#endif  // CIRCLINE_REFINE_BLOCK_CHAIN_H_
