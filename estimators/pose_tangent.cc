#include "circline/estimators/pose_tangent.h"

namespace circline {

Matrix6d TangentJacobian(const CameraPose& estimate, const PoseTangent& tangent) {
  // Rows [omega, v] of T on one side. T^-1 on the right is T on the left, and the other way round.
  Matrix6d J = Matrix6d::Identity();
  if (tangent.right == tangent.world_from_cam) {
    J.bottomLeftCorner<3, 3>() = CrossMatrix(estimate.translation);
  } else {
    J.topLeftCorner<3, 3>() = J.bottomRightCorner<3, 3>() = estimate.rotation.transpose();
  }
  if (tangent.world_from_cam) J = -J;
  if (!tangent.rotation_first) J.topRows<3>().swap(J.bottomRows<3>());
  return J;
}

}  // namespace circline
