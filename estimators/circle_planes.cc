#include "circline/estimators/circle_planes.h"

#include <Eigen/Eigenvalues>
#include <cstddef>

#include "circline/estimators/conic.h"

namespace circline {
namespace {

// The normal nearest to another of the circles that a conic shows; that itself where it shows none.
Eigen::Vector3d NearestNormal(const Vector6d& conic, const Eigen::Vector3d& normal) {
  std::array<CirclePose, 2> poses;
  const int count = CirclePoses(VectorToConic(conic), &poses);
  if (count == 0) return normal;
  const bool is_second = count == 2 && poses[1].normal.dot(normal) > poses[0].normal.dot(normal);
  return poses[is_second ? 1 : 0].normal;
}

}  // namespace

int CirclePlanes(const ConicFit& fit, std::array<CirclePlane, 2>* planes) {
  // The errors of the conic are the sum of the columns of a square root of its covariance, each
  // times a number of standard deviation 1.
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(fit.Covariance());
  const Matrix6d root =
      eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
  const Vector6d conic = ConicToVector(fit.conic);
  std::array<CirclePose, 2> poses;
  const int count = CirclePoses(fit.conic, &poses);
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    (*planes)[i] = {poses[i]};
    // Statistical linearisation: over a standard deviation to each side, not at a point, as a
    // circle that is seen from the front is anything but linear.
    for (int k = 0; k < 6; ++k) {
      const Eigen::Vector3d change = 0.5 * (NearestNormal(conic + root.col(k), poses[i].normal) -
                                            NearestNormal(conic - root.col(k), poses[i].normal));
      (*planes)[i].covariance += change * change.transpose();
    }
  }
  return count;
}

}  // namespace circline
