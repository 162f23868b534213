#include "circline/refine/circle_planes.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>

#include "circline/estimators/conic.h"

namespace circline {

int CirclePlanes(const ConicFit& fit, std::array<CirclePlane, 2>* planes) {
  std::array<CirclePose, 2> poses, moved;
  const int count = CirclePoses(fit.conic, &poses);
  for (std::size_t i = 0; i < planes->size(); ++i) (*planes)[i] = {poses[i]};
  const Eigen::SelfAdjointEigenSolver<Matrix6d> eigen(fit.Covariance());
  const Vector6d conic = ConicToVector(fit.conic);
  for (int k = 1; k < 6; ++k) {  // The first has no variance.
    const Vector6d step =
        std::sqrt(std::max(0.0, eigen.eigenvalues()[k])) * eigen.eigenvectors().col(k);
    if (CirclePoses(VectorToConic(conic + step), &moved) != count) return 0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      const Eigen::Vector3d turn = moved[i].normal.cross(poses[i].normal);
      (*planes)[i].covariance += turn * turn.transpose();
    }
  }
  return count;
}

}  // namespace circline
