#include "apps/reconstruct/box_edge_cost.h"

#include <Eigen/Dense>
#include <utility>

#include "circline/refine/block_chain.h"

namespace circline::apps {
namespace {

enum Block { kRotation, kTranslation, kLength, kSkew = kLength + 3 };

// d (S v) / d skew, S = I + half the skew, symmetric: strain without rotation.
Eigen::Matrix3d BySkew(const Eigen::Vector3d& v) {
  Eigen::Matrix3d by;
  by << 0.0, v.z(), v.y(),  //
      v.z(), 0.0, v.x(),    //
      v.y(), v.x(), 0.0;
  return 0.5 * by;
}

}  // namespace

// The edge's image is the line p x d, in the camera frame: p a point of the edge, d its direction.
struct BoxEdgeCost::Placed {
  Eigen::Matrix3d R;
  Eigen::Vector3d corner, along;                // In the box's axes, before the skew.
  Eigen::Vector3d skewed_corner, skewed_along;  // The same after it.
  Eigen::Vector3d p, d;

  Placed(const BoxEdgeCost& cost, const double* const* parameters)
      : R(RotationFromBlock(parameters[kRotation])),
        corner(Eigen::Vector3d::Zero()),
        along(Eigen::Vector3d::Unit(cost.axis_)) {
    for (int k = 0; k < 3; ++k) {
      if (k != cost.axis_ && cost.far_[static_cast<std::size_t>(k)])
        corner[k] = parameters[kLength + k][0];
    }
    const Eigen::Map<const Eigen::Vector3d> skew(parameters[kSkew]);
    skewed_corner = corner + BySkew(corner) * skew;
    skewed_along = along + BySkew(along) * skew;
    p = R * skewed_corner + Eigen::Map<const Eigen::Vector3d>(parameters[kTranslation]);
    d = R * skewed_along;
  }
};

BoxEdgeCost::BoxEdgeCost(ImagePoints points, int axis, const std::array<bool, 3>& far, bool camera)
    : CurveCost(std::move(points), 2, {4, 3, 1, 1, 1, 3}, false, camera, 0),
      axis_(axis),
      far_(far) {}

void BoxEdgeCost::Distances(const double* const* parameters, std::vector<double>* distances) const {
  const Placed placed(*this, parameters);
  points()->LineDistances(placed.p.cross(placed.d), CameraShifts(parameters), distances);
}

bool BoxEdgeCost::EvaluateWith(const Weighing& weighing, const double* const* parameters,
                               double* residuals, double** jacobians) const {
  const Placed e(*this, parameters);
  const int rows = num_residuals();
  Rows U;
  if (!SumAbout(e.p.cross(e.d), weighing, parameters, residuals, jacobians, &U)) return false;
  if (jacobians == nullptr) return true;
  const Eigen::Matrix3d by_p = -CrossMatrix(e.d), by_d = CrossMatrix(e.p);
  const Eigen::Matrix3d by_corner = by_p * e.R, by_along = by_d * e.R;
  WriteJacobian(
      -U * (by_corner * CrossMatrix(e.skewed_corner) + by_along * CrossMatrix(e.skewed_along)) *
          DeltaFromQuaternion(parameters[kRotation]),
      rows, kRotation, jacobians);
  WriteJacobian(U * by_p, rows, kTranslation, jacobians);
  const Eigen::Map<const Eigen::Vector3d> skew(parameters[kSkew]);
  for (int k = 0; k < 3; ++k) {
    const bool counts = k != axis_ && far_[static_cast<std::size_t>(k)];
    const Eigen::Vector3d unit = Eigen::Vector3d::Unit(k);
    const Eigen::Vector3d by_length =
        counts ? by_corner * (unit + BySkew(unit) * skew) : Eigen::Vector3d::Zero().eval();
    WriteJacobian(U * by_length, rows, kLength + k, jacobians);
  }
  WriteJacobian(U * (by_corner * BySkew(e.corner) + by_along * BySkew(e.along)), rows, kSkew,
                jacobians);
  return true;
}

}  // namespace circline::apps
