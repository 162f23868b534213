#include "circline/ransac/pencil_model.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "circline/ransac/sampler.h"

namespace circline {

PencilModel::PencilModel(const std::vector<LineFit>& lines, const std::vector<int>& indices,
                         double model_sigma_rad)
    : model_variance_(static_cast<float>(
          std::max(model_sigma_rad * model_sigma_rad, 1e-20))) {  // Exact lines: no 0 / 0.
  const int n = static_cast<int>(indices.size());
  const std::vector<int> order = RandomOrder(n, 1);
  index_.resize(indices.size());
  lines_.resize(indices.size());
  data_.resize(9 * indices.size());
  for (std::size_t k = 0; k < indices.size(); ++k) {
    index_[k] = indices[static_cast<std::size_t>(order[k])];
    const LineFit& line = lines[static_cast<std::size_t>(index_[k])];
    lines_[k] = line.line.normalized();
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
    eigen.computeDirect(line.covariance);
    for (int c = 0; c < 3; ++c) {
      const std::size_t row = static_cast<std::size_t>(c) * indices.size() + k;
      data_[row] = static_cast<float>(lines_[k][c]);
      for (int j = 1; j <= 2; ++j) {  // Eigenvalue 0 is the line itself.
        const double sigma = std::sqrt(std::max(0.0, eigen.eigenvalues()[j]));
        data_[row + static_cast<std::size_t>(3 * j) * indices.size()] =
            static_cast<float>(sigma * eigen.eigenvectors()(c, j));
      }
    }
  }
}

bool PencilModel::Fit(const int* sample, Value* direction) const {
  const Eigen::Vector3d cross = lines_[static_cast<std::size_t>(sample[0])].cross(
      lines_[static_cast<std::size_t>(sample[1])]);
  const double norm = cross.norm();
  if (!(norm > kCoincidentRad)) return false;
  *direction = {cross.x() / norm, cross.y() / norm, cross.z() / norm};
  return true;
}

void PencilModel::SquaredResiduals(const Value& direction, int begin, int end, float* r2) const {
  const std::size_t n = index_.size();
  const float* l = data_.data() + begin;
  const float* p = l + 3 * n;
  const float* q = l + 6 * n;
  const float x = static_cast<float>(direction[0]), y = static_cast<float>(direction[1]),
              z = static_cast<float>(direction[2]);
  const std::size_t size = static_cast<std::size_t>(end - begin);
  for (std::size_t i = 0; i < size; ++i) {
    const float miss = l[i] * x + l[i + n] * y + l[i + 2 * n] * z;
    const float a = p[i] * x + p[i + n] * y + p[i + 2 * n] * z;
    const float b = q[i] * x + q[i + n] * y + q[i + 2 * n] * z;
    r2[i] = miss * miss / (a * a + b * b + model_variance_);
  }
}

double PencilModel::Variance(const Eigen::Vector3d& direction, int i) const {
  const std::size_t n = index_.size(), k = static_cast<std::size_t>(i);
  double p = 0.0, q = 0.0;
  for (int c = 0; c < 3; ++c) {
    const std::size_t row = static_cast<std::size_t>(c) * n + k;
    p += static_cast<double>(data_[row + 3 * n]) * direction[c];
    q += static_cast<double>(data_[row + 6 * n]) * direction[c];
  }
  return p * p + q * q + static_cast<double>(model_variance_);
}

// Gauss-Newton in the tangent plane of the sphere, the variances of the lines held at the current
// direction.
bool PencilModel::Refine(const float* weights, Value* direction) const {
  const Eigen::Vector3d v(direction->data()), e1 = v.unitOrthogonal(), e2 = v.cross(e1);
  double a = 0.0, b = 0.0, c = 0.0, g1 = 0.0, g2 = 0.0;
  for (int i = 0; i < NumData(); ++i) {
    if (!(weights[i] > 0.0f)) continue;
    const double w = static_cast<double>(weights[i]) / Variance(v, i);
    const double miss = Line(i).dot(v), d1 = Line(i).dot(e1), d2 = Line(i).dot(e2);
    a += w * d1 * d1;
    b += w * d1 * d2;
    c += w * d2 * d2;
    g1 += w * d1 * miss;
    g2 += w * d2 * miss;
  }
  const double det = a * c - b * b;
  if (!(det > 1e-12 * (a + c) * (a + c))) return false;
  const Eigen::Vector3d moved = v - (c * g1 - b * g2) / det * e1 - (a * g2 - b * g1) / det * e2;
  const double norm = moved.norm();
  if (!(norm < 10.0)) return false;  // Not a small step: the start was no good, or is not finite.
  *direction = {moved.x() / norm, moved.y() / norm, moved.z() / norm};
  return true;
}

}  // namespace circline
