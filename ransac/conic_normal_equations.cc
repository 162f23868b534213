#include "circline/ransac/conic_normal_equations.h"

#include <Eigen/Dense>
#include <cstddef>

namespace circline {

bool ConicNormalEquations::Step(Vector6d* step) {
  Flush();
  Matrix6d H;
  Vector6d gradient;
  std::size_t k = 0;
  for (int m = 0; m < 6; ++m) {
    for (int n = m; n < 6; ++n) H(m, n) = H(n, m) = sums_[k++];
    gradient[m] = sums_[k++];
  }
  const Eigen::Map<const Vector6d> q(q_.data());
  const double trace = H.trace();
  H += trace * q * q.transpose();
  H.diagonal().array() += 1e-12 * trace;
  *step = -H.ldlt().solve(gradient);
  return step->allFinite();
}

void ConicNormalEquations::Flush() {
  // Keeps 0 / 0 out of the centre of a conic.
  constexpr double kTinySquare = 1e-100;
  if (size_ == 0) return;
  for (int i = size_; i < kBlock; ++i) {
    x_[i] = x_[0];
    y_[i] = y_[0];
    for (Block& j : j_) j[i] = j[0];
    w_[i] = 0.0;
  }
  size_ = 0;
  const auto [a, b, c, d, e, f] = q_;
  const Block gx = a * x_ + b * y_ + d, gy = b * x_ + c * y_ + e;
  const Block gu = j_[0] * gx + j_[2] * gy, gv = j_[1] * gx + j_[3] * gy;
  const Block inverse = 0.5 / (gu * gu + gv * gv + kTinySquare).sqrt();
  std::array<Block, 7> row;  // Derivatives, and the residual.
  row[6] = (x_ * gx + y_ * gy + d * x_ + e * y_ + f) * inverse;
  const Block s = 4.0 * row[6] * inverse * inverse;
  const Block hx = s * (j_[0] * gu + j_[1] * gv), hy = s * (j_[2] * gu + j_[3] * gv);
  row[0] = x_ * (x_ * inverse - hx);
  row[1] = 2.0 * x_ * y_ * inverse - hx * y_ - hy * x_;
  row[2] = y_ * (y_ * inverse - hy);
  row[3] = 2.0 * x_ * inverse - hx;
  row[4] = 2.0 * y_ * inverse - hy;
  row[5] = inverse;
  std::size_t k = 0;
  for (std::size_t m = 0; m < 6; ++m) {
    const Block weighted = w_ * row[m];
    for (std::size_t n = m; n < 7; ++n) sums_[k++] += (weighted * row[n]).sum();
  }
}

}  // namespace circline
