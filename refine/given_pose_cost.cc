// A pose against one that is known in another frame and unit.
#include <ceres/autodiff_cost_function.h>
#include <ceres/rotation.h>

#include <Eigen/Geometry>
#include <cmath>

#include "circline/refine/given_poses.h"

namespace circline {
namespace {

struct GivenPoseResidual {
  Eigen::Quaterniond rotation;
  Eigen::Vector3d translation;
  double rotation_sigma, translation_sigma;

  template <typename T>
  bool operator()(const T* q, const T* t, const T* frame_q, const T* frame_t, const T* log_scale,
                  T* residual) const {
    using std::exp;
    const T given[4] = {static_cast<T>(rotation.w()), static_cast<T>(rotation.x()),
                        static_cast<T>(rotation.y()), static_cast<T>(rotation.z())};
    const T frame[4] = {frame_q[3], frame_q[0], frame_q[1], frame_q[2]};
    const T inverse[4] = {q[3], -q[0], -q[1], -q[2]};
    T expected[4], difference[4], moved[3];
    ceres::QuaternionProduct(given, frame, expected);
    ceres::QuaternionProduct(expected, inverse, difference);
    ceres::QuaternionToAngleAxis(difference, residual);
    ceres::UnitQuaternionRotatePoint(given, frame_t, moved);
    for (int k = 0; k < 3; ++k) {
      residual[k] /= rotation_sigma;
      residual[3 + k] =
          (t[k] - (moved[k] + translation[k]) * exp(-log_scale[0])) / translation_sigma;
    }
    return true;
  }
};

}  // namespace

ceres::CostFunction* NewGivenPosePrior(const Eigen::Matrix3d& rotation,
                                       const Eigen::Vector3d& translation, double rotation_sigma,
                                       double translation_sigma) {
  return new ceres::AutoDiffCostFunction<GivenPoseResidual, 6, 4, 3, 4, 3, 1>(new GivenPoseResidual{
      Eigen::Quaterniond(rotation), translation, rotation_sigma, translation_sigma});
}

}  // namespace circline
