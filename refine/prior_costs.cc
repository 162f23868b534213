// What is known beside the pixels. Few and small: derivatives are automatic.
#include <ceres/autodiff_cost_function.h>
#include <ceres/dynamic_autodiff_cost_function.h>
#include <ceres/rotation.h>

#include <Eigen/Dense>
#include <cmath>

#include "circline/estimators/basics.h"
#include "circline/refine/block_chain.h"
#include "circline/refine/cost_functions.h"
#include "circline/refine/given_poses.h"

namespace circline {
namespace {

// A value of a jet or a double.
double Scalar(double v) { return v; }
template <typename T, int N>
double Scalar(const ceres::Jet<T, N>& v) {
  return v.a;
}

struct AngleResidual {
  double angle, sigma;

  template <typename T>
  bool operator()(const T* a, const T* b, T* residual) const {
    using std::atan2;
    using std::sqrt;
    T cross[3];
    ceres::CrossProduct(a, b, cross);
    const T sine = sqrt(ceres::DotProduct(cross, cross)), cosine = ceres::DotProduct(a, b);
    if (!(Scalar(sine) > 0.0)) return false;
    const T between = atan2(sine, cosine);
    // The angle or its supplement, whichever is nearer.
    const double folded = std::acos(std::cos(angle));
    const double direct = std::abs(Scalar(between) - folded),
                 other = std::abs(Scalar(between) - (kPi - folded));
    residual[0] = (between - (direct <= other ? folded : kPi - folded)) / sigma;
    return true;
  }
};

struct LengthResidual {
  double length, sigma;

  template <typename T>
  bool operator()(const T* a, const T* b, T* residual) const {
    using std::log;
    const T x = b[0] - a[0], y = b[1] - a[1], squared = x * x + y * y;
    if (!(Scalar(squared) > 0.0)) return false;
    residual[0] = 0.5 * log(squared / (length * length)) / sigma;
    return true;
  }
};

struct LogResidual {
  double value, sigma;

  template <typename T>
  bool operator()(const T* x, T* residual) const {
    using std::log;
    if (!(Scalar(x[0]) > 0.0)) return false;
    residual[0] = log(x[0] / value) / sigma;
    return true;
  }
};

// Rows of `across` times the direction.
template <int kRows>
struct AcrossResidual {
  Eigen::Matrix<double, kRows, 3> across;

  template <typename T>
  bool operator()(const T* direction, T* residual) const {
    for (int k = 0; k < kRows; ++k) {
      residual[k] =
          across(k, 0) * direction[0] + across(k, 1) * direction[1] + across(k, 2) * direction[2];
    }
    return true;
  }
};

struct GaussianResidual {
  std::vector<double> sigmas, mean;

  template <typename T>
  bool operator()(const T* const* x, T* residual) const {
    for (std::size_t k = 0; k < sigmas.size(); ++k) {
      const double at = mean.empty() ? 0.0 : mean[k];
      residual[k] = sigmas[k] > 0.0 ? (x[0][k] - at) / sigmas[k] : static_cast<T>(0.0);
    }
    return true;
  }
};

// ceres' order of a quaternion is w first.
template <typename T>
void ToCeres(const Eigen::Quaterniond& q, T* out) {
  const double values[4] = {q.w(), q.x(), q.y(), q.z()};
  for (int k = 0; k < 4; ++k) out[k] = static_cast<T>(values[k]);
}

struct PoseResidual {
  Eigen::Quaterniond inverse_mean;
  Eigen::Vector3d translation;
  Matrix6d square_root;  // Of the information.

  template <typename T>
  bool operator()(const T* q, const T* t, T* residual) const {
    const T rotation[4] = {q[3], q[0], q[1], q[2]};
    T mean[4], difference[4], delta[6];
    ToCeres(inverse_mean, mean);
    ceres::QuaternionProduct(rotation, mean, difference);
    ceres::QuaternionToAngleAxis(difference, delta);
    for (int k = 0; k < 3; ++k) delta[3 + k] = t[k] - translation[k];
    for (int k = 0; k < 6; ++k) {
      residual[k] = static_cast<T>(0.0);
      for (int i = 0; i < 6; ++i) residual[k] += square_root(k, i) * delta[i];
    }
    return true;
  }
};

// A pose against one that is known in another frame and unit.
struct GivenPoseResidual {
  Eigen::Quaterniond rotation;
  Eigen::Vector3d translation;
  double rotation_sigma, translation_sigma;

  template <typename T>
  bool operator()(const T* q, const T* t, const T* frame_q, const T* frame_t, const T* log_scale,
                  T* residual) const {
    using std::exp;
    T given[4];
    ToCeres(rotation, given);
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

struct MeasuredDirectionResidual {
  Eigen::Vector3d in_world, in_camera;
  double sigma;

  template <typename T>
  bool operator()(const T* q, T* residual) const {
    const T rotation[4] = {q[3], q[0], q[1], q[2]};
    const T world[3] = {static_cast<T>(in_world.x()), static_cast<T>(in_world.y()),
                        static_cast<T>(in_world.z())};
    T camera[3];
    ceres::UnitQuaternionRotatePoint(rotation, world, camera);
    // All three, so that the opposite direction is no solution.
    for (int k = 0; k < 3; ++k) residual[k] = (camera[k] - in_camera[k]) / sigma;
    return true;
  }
};

Eigen::Matrix<double, 2, 3> Across(const Eigen::Vector3d& axis, double sigma) {
  Eigen::Matrix<double, 2, 3> across;
  across.row(0) = axis.unitOrthogonal() / sigma;
  across.row(1) = axis.cross(axis.unitOrthogonal()) / sigma;
  return across;
}

}  // namespace

ceres::CostFunction* NewAngleCost(double angle, double sigma) {
  return new ceres::AutoDiffCostFunction<AngleResidual, 1, 3, 3>(new AngleResidual{angle, sigma});
}

ceres::CostFunction* NewLengthCost(double length, double sigma) {
  return new ceres::AutoDiffCostFunction<LengthResidual, 1, 2, 2>(
      new LengthResidual{length, sigma});
}

ceres::CostFunction* NewLogPrior(double value, double sigma) {
  return new ceres::AutoDiffCostFunction<LogResidual, 1, 1>(new LogResidual{value, sigma});
}

ceres::CostFunction* NewGaussianPrior(const std::vector<double>& sigmas,
                                      const std::vector<double>& mean) {
  auto* cost =
      new ceres::DynamicAutoDiffCostFunction<GaussianResidual>(new GaussianResidual{sigmas, mean});
  cost->AddParameterBlock(static_cast<int>(sigmas.size()));
  cost->SetNumResiduals(static_cast<int>(sigmas.size()));
  return cost;
}

ceres::CostFunction* NewDirectionPrior(const Eigen::Vector3d& axis, double sigma) {
  return new ceres::AutoDiffCostFunction<AcrossResidual<2>, 2, 3>(
      new AcrossResidual<2>{Across(axis, sigma)});
}

ceres::CostFunction* NewInPlanePrior(const Eigen::Vector3d& normal, double sigma) {
  return new ceres::AutoDiffCostFunction<AcrossResidual<1>, 1, 3>(
      new AcrossResidual<1>{normal.transpose() / sigma});
}

ceres::CostFunction* NewPosePrior(const Eigen::Matrix3d& rotation,
                                  const Eigen::Vector3d& translation, const Matrix6d& covariance) {
  const Eigen::LLT<Matrix6d> llt(covariance);
  if (llt.info() != Eigen::Success) return nullptr;
  return new ceres::AutoDiffCostFunction<PoseResidual, 6, 4, 3>(
      new PoseResidual{Eigen::Quaterniond(rotation).conjugate(), translation,
                       llt.matrixL().solve(Matrix6d::Identity())});
}

ceres::CostFunction* NewGivenPosePrior(const Eigen::Matrix3d& rotation,
                                       const Eigen::Vector3d& translation, double rotation_sigma,
                                       double translation_sigma) {
  return new ceres::AutoDiffCostFunction<GivenPoseResidual, 6, 4, 3, 4, 3, 1>(new GivenPoseResidual{
      Eigen::Quaterniond(rotation), translation, rotation_sigma, translation_sigma});
}

ceres::CostFunction* NewDirectionMeasurement(const Eigen::Vector3d& in_world,
                                             const Eigen::Vector3d& in_camera, double sigma) {
  return new ceres::AutoDiffCostFunction<MeasuredDirectionResidual, 3, 4>(
      new MeasuredDirectionResidual{in_world, in_camera, sigma});
}

}  // namespace circline
