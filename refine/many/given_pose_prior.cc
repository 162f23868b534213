// Derivatives are automatic: there are few of these, and they are small.
#include <ceres/autodiff_cost_function.h>

#include <Eigen/Dense>

#include "circline/refine/manifolds.h"
#include "circline/refine/many/adjust_problem.h"

namespace circline {
namespace {

// A pose against one that is known in another frame and unit.
struct GivenPoseResidual {
  Eigen::Quaterniond rotation;
  Eigen::Vector3d translation;
  double rotation_sigma, translation_sigma;

  template <typename T>
  bool operator()(const T* q, const T* t, const T* frame_q, const T* frame_t, const T* log_scale,
                  T* residual) const {
    using std::exp;
    const Eigen::Quaternion<T> given = rotation.cast<T>();
    const Eigen::Matrix<T, 3, 1> moved =
        given * Eigen::Map<const Eigen::Matrix<T, 3, 1>>(frame_t) + translation.cast<T>();
    Eigen::Map<Eigen::Matrix<T, 3, 1>> turn(residual), step(residual + 3);
    turn = AngleAxisOf<T>(given * Eigen::Map<const Eigen::Quaternion<T>>(frame_q) *
                          Eigen::Map<const Eigen::Quaternion<T>>(q).conjugate()) /
           static_cast<T>(rotation_sigma);
    step = (Eigen::Map<const Eigen::Matrix<T, 3, 1>>(t) - moved * exp(-log_scale[0])) /
           static_cast<T>(translation_sigma);
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
