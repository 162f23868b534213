// What the cost functions share: parameter blocks one after the other, and derivatives by them.
// Internal: not installed.
#ifndef CIRCLINE_REFINE_BLOCK_CHAIN_H_
#define CIRCLINE_REFINE_BLOCK_CHAIN_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>

#include "circline/estimators/pose.h"
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

// jacobians[block] (num_residuals x size, row-major) = [J; 0], where ceres asks for it.
template <typename Derived>
void WriteJacobian(const Eigen::MatrixBase<Derived>& J, int num_residuals, int block,
                   double** jacobians) {
  if (jacobians[block] == nullptr) return;
  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> out(
      jacobians[block], num_residuals, J.cols());
  out.topRows(J.rows()) = J;
  out.bottomRows(num_residuals - J.rows()).setZero();
}

// The camera's block where the derivatives of its last shifts are zero.
template <typename Derived>
void WriteCameraJacobian(const Eigen::MatrixBase<Derived>& J, int num_residuals, int block,
                         double** jacobians) {
  if (jacobians[block] == nullptr) return;
  Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, kCameraSize, Eigen::RowMajor>> out(
      jacobians[block], num_residuals, kCameraSize);
  out.setZero();
  out.topLeftCorner(J.rows(), J.cols()) = J;
}

// Without derivatives the whole cost is one residual.
inline void CostOnly(double twice_cost, int num_residuals, double* residuals) {
  std::fill(residuals, residuals + num_residuals, 0.0);
  residuals[num_residuals - 1] = std::sqrt(std::max(0.0, twice_cost));
}

}  // namespace circline

#endif  // CIRCLINE_REFINE_BLOCK_CHAIN_H_
