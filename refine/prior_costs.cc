// What is known beside the pixels. Few and small: derivatives are automatic.
#include <ceres/autodiff_cost_function.h>
#include <ceres/normal_prior.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/directions.h"
#include "circline/refine/cost_functions.h"
#include "circline/refine/manifolds.h"

namespace circline {
namespace {

template <typename T>
using Vector3 = Eigen::Matrix<T, 3, 1>;
// Parameter blocks: a vector, and a quaternion (x, y, z, w).
template <typename T>
using Vector3Block = Eigen::Map<const Vector3<T>>;
template <typename T>
using RotationBlock = Eigen::Map<const Eigen::Quaternion<T>>;

struct AngleResidual {
  double angle, sigma;

  template <typename T>
  bool operator()(const T* a, const T* b, T* residual) const {
    using std::abs;
    using std::atan2;
    const Vector3Block<T> u(a), v(b);
    const Vector3<T> cross = u.cross(v);
    if (!(cross.squaredNorm() > 0.0)) return false;
    const T between = atan2(cross.norm(), u.dot(v));
    // The angle or its supplement, whichever is nearer.
    const double folded = std::acos(std::cos(angle));
    const T direct = between - folded, other = between - (kPi - folded);
    residual[0] = (abs(direct) <= abs(other) ? direct : other) / sigma;
    return true;
  }
};

struct LengthResidual {
  double length, sigma;

  template <typename T>
  bool operator()(const T* a, const T* b, T* residual) const {
    using std::log;
    const T x = b[0] - a[0], y = b[1] - a[1], squared = x * x + y * y;
    if (!(squared > 0.0)) return false;
    residual[0] = 0.5 * log(squared / (length * length)) / sigma;
    return true;
  }
};

struct LogResidual {
  double value, sigma;

  template <typename T>
  bool operator()(const T* x, T* residual) const {
    using std::log;
    if (!(x[0] > 0.0)) return false;
    residual[0] = log(x[0] / value) / sigma;
    return true;
  }
};

struct PoseResidual {
  Eigen::Quaterniond inverse_mean;
  Eigen::Vector3d translation;
  Matrix6d square_root;  // Of the information.

  template <typename T>
  bool operator()(const T* q, const T* t, T* residual) const {
    Eigen::Matrix<T, 6, 1> delta;
    delta << AngleAxisOf<T>(RotationBlock<T>(q) * inverse_mean.cast<T>()),
        Vector3Block<T>(t) - translation.cast<T>();
    Eigen::Map<Eigen::Matrix<T, 6, 1>> whitened(residual);
    whitened = square_root.cast<T>() * delta;
    return true;
  }
};

struct MeasuredDirectionResidual {
  Eigen::Vector3d in_world, in_camera;
  double sigma;

  template <typename T>
  bool operator()(const T* q, T* residual) const {
    // All three, so that the opposite direction is no solution.
    Eigen::Map<Vector3<T>> difference(residual);
    difference =
        (RotationBlock<T>(q) * in_world.cast<T>() - in_camera.cast<T>()) / static_cast<T>(sigma);
    return true;
  }
};

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
  const auto size = static_cast<Eigen::Index>(sigmas.size());
  const Eigen::VectorXd inverse =
      Eigen::Map<const Eigen::VectorXd>(sigmas.data(), size).unaryExpr([](double s) {
        return s > 0.0 ? 1.0 / s : 0.0;
      });
  Eigen::VectorXd at = Eigen::VectorXd::Zero(size);
  std::copy(mean.begin(), mean.end(), at.data());
  return new ceres::NormalPrior(inverse.asDiagonal().toDenseMatrix(), at);
}

ceres::CostFunction* NewDirectionPrior(const Eigen::Vector3d& axis, double sigma) {
  return new ceres::NormalPrior(BasisAcross(axis).transpose() / sigma, Eigen::Vector3d::Zero());
}

ceres::CostFunction* NewInPlanePrior(const Eigen::Vector3d& normal, double sigma) {
  return new ceres::NormalPrior(normal.transpose() / sigma, Eigen::Vector3d::Zero());
}

ceres::CostFunction* NewPosePrior(const Eigen::Matrix3d& rotation,
                                  const Eigen::Vector3d& translation, const Matrix6d& covariance) {
  const Eigen::LLT<Matrix6d> llt(covariance);
  if (llt.info() != Eigen::Success) return nullptr;
  return new ceres::AutoDiffCostFunction<PoseResidual, 6, 4, 3>(
      new PoseResidual{Eigen::Quaterniond(rotation).conjugate(), translation,
                       llt.matrixL().solve(Matrix6d::Identity())});
}

ceres::CostFunction* NewDirectionMeasurement(const Eigen::Vector3d& in_world,
                                             const Eigen::Vector3d& in_camera, double sigma) {
  return new ceres::AutoDiffCostFunction<MeasuredDirectionResidual, 3, 4>(
      new MeasuredDirectionResidual{in_world, in_camera, sigma});
}

}  // namespace circline
