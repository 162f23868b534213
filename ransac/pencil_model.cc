#include "circline/ransac/pencil_model.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "circline/ransac/sampler.h"

namespace circline {
namespace {

bool Usable(const LineFit& line) {
  return line.line.allFinite() && line.covariance.allFinite() && line.line.norm() > 0.5;
}

}  // namespace

std::vector<int> UsableLines(const std::vector<LineFit>& lines) {
  std::vector<int> indices;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (Usable(lines[i])) indices.push_back(static_cast<int>(i));
  }
  return indices;
}

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

bool PencilModel::Refine(const float* weights, Value* direction) const {
  Eigen::Vector3d v(direction->data());
  DirectionStep step(v);
  for (int i = 0; i < NumData(); ++i) {
    if (!(weights[i] > 0.0f)) continue;
    step.Add(Line(i), Variance(v, i), static_cast<double>(weights[i]));
  }
  if (!step.Move(&v)) return false;
  *direction = {v.x(), v.y(), v.z()};
  return true;
}

DirectionStep::DirectionStep(const Eigen::Vector3d& direction)
    : v_(direction), e1_(direction.unitOrthogonal()), e2_(direction.cross(e1_)) {}

void DirectionStep::Add(const Eigen::Vector3d& line, double variance, double weight) {
  const double w = weight / variance;
  const double miss = line.dot(v_), d1 = line.dot(e1_), d2 = line.dot(e2_);
  a_ += w * d1 * d1;
  b_ += w * d1 * d2;
  c_ += w * d2 * d2;
  g1_ += w * d1 * miss;
  g2_ += w * d2 * miss;
}

bool DirectionStep::Move(Eigen::Vector3d* direction) const {
  const double det = a_ * c_ - b_ * b_;
  if (!(det > 1e-12 * (a_ + c_) * (a_ + c_))) return false;
  const Eigen::Vector3d moved =
      v_ - (c_ * g1_ - b_ * g2_) / det * e1_ - (a_ * g2_ - b_ * g1_) / det * e2_;
  const double norm = moved.norm();
  if (!(norm < 10.0)) return false;  // Not a small step: the start was no good, or is not finite.
  *direction = moved / norm;
  return true;
}

}  // namespace circline
