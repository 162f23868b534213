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

// The direction that the lines miss least, the variances of the lines held at the current one.
bool PencilModel::Refine(const float* weights, Value* direction) const {
  const Eigen::Vector3d v(direction->data());
  Eigen::Matrix3d scatter = Eigen::Matrix3d::Zero();
  for (int i = 0; i < NumData(); ++i) {
    if (!(weights[i] > 0.0f)) continue;
    scatter += static_cast<double>(weights[i]) / Variance(v, i) * Line(i) * Line(i).transpose();
  }
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(scatter);
  constexpr double kOneLine = 1e-12;  // Of the largest: the lines coincide.
  if (!(eigen.eigenvalues()[1] > kOneLine * eigen.eigenvalues()[2])) return false;
  Eigen::Map<Eigen::Vector3d>(direction->data()) = eigen.eigenvectors().col(0);
  return true;
}

}  // namespace circline
