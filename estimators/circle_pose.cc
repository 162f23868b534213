#include "circline/estimators/circle_pose.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>

#include "circline/estimators/conic.h"

namespace circline {

int CirclePoses(const Eigen::Matrix3d& conic, std::array<CirclePose, 2>* poses) {
  Eigen::Matrix3d C;
  if (!NormalizeEllipse(conic, &C)) return 0;
  // compute, not computeDirect: the latter loses the normal of a nearly frontal circle.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(C);
  const double l1 = eigen.eigenvalues()[2], l2 = eigen.eigenvalues()[1],
               l3 = eigen.eigenvalues()[0];
  constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
  if (!(l2 > kEpsilon * l1) || !(l3 < -kEpsilon * l1)) return 0;  // Degenerate to rounding.
  const Eigen::Vector3d v1 = eigen.eigenvectors().col(2), v3 = eigen.eigenvectors().col(0);

  // n = (+-s, 0, k) in the eigenframe annihilates the pencil member C - l2 I. On the plane n . X =
  // 1 the centre is the pole C^-1 n / (n^T C^-1 n) and the radius sqrt(-l1 l3) / l2, which gives
  // the centre in units of the radius without cancellation.
  const double s = std::sqrt(std::max(0.0, (l1 - l2) / (l1 - l3)));
  const double k = std::sqrt((l2 - l3) / (l1 - l3));
  const double inverse_radius = 1.0 / std::sqrt(-l1 * l3);
  const int count = l1 - l2 > kEpsilon * l1 ? 2 : 1;
  for (int i = 0; i < count; ++i) {
    const double sign = i == 0 ? 1.0 : -1.0;
    Eigen::Vector3d away = sign * s * v1 + k * v3;
    Eigen::Vector3d center = (sign * s * l3 * v1 + k * l1 * v3) * inverse_radius;
    if (center.z() < 0.0) {
      away = -away;
      center = -center;
    }
    (*poses)[static_cast<std::size_t>(i)] = {-away, center};
  }
  return count;
}

Eigen::Matrix3d ProjectCircle(const CirclePose& pose) {
  // On the plane n . X = h a ray x meets X = h x / (n . x); |X - c|^2 = 1 times (n . x)^2 is
  // quadratic in x.
  const Eigen::Vector3d& n = pose.normal;
  const Eigen::Vector3d& c = pose.center;
  const double h = n.dot(c);
  const Eigen::Matrix3d C = h * h * Eigen::Matrix3d::Identity() -
                            h * (c * n.transpose() + n * c.transpose()) +
                            (c.squaredNorm() - 1.0) * n * n.transpose();
  return C / C.norm();
}

}  // namespace circline
