// One step of least squares for a conic.
#include <Eigen/Dense>
#include <array>
#include <cstddef>

#include "circline/estimators/conic.h"
#include "circline/ransac/conic_model.h"

namespace circline {
namespace {

// Gauss-Newton on r = v / (2 |g|), v = q . m and g the gradient per pixel (halved), of the
// coefficients q of a conic. Points are worked off in blocks, so that the compiler can work on
// several at a time: half the time of point by point.
class ConicNormalEquations {
 public:
  explicit ConicNormalEquations(const ConicModel::Value& q) : q_(q) {}

  void Add(const CalibratedPoint& p, double weight) {
    x_[size_] = p.x.x();
    y_[size_] = p.x.y();
    for (std::size_t k = 0; k < 4; ++k) j_[k][size_] = p.x_from_pixel[k];
    w_[size_] = weight;
    if (++size_ == kBlock) SumBlock();
    ++count_;
  }

  int count() const { return count_; }

  // The step of q that minimises the linearised cost, orthogonal to q: r does not change with the
  // scale of q, so q q^T closes the rank. False if there is none.
  bool Solve(Vector6d* step) {
    if (size_ > 0) SumBlock();
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

 private:
  static constexpr int kBlock = 32;
  using Block = Eigen::Array<double, kBlock, 1>;

  void SumBlock() {
    constexpr double kTinySquare = 1e-100;  // Keeps 0 / 0 out of the centre of a conic.
    // What is not filled are points of an earlier block or zeros.
    w_.tail(kBlock - size_).setZero();
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

  ConicModel::Value q_;
  Block x_ = Block::Zero(), y_ = Block::Zero(), w_;
  std::array<Block, 4> j_{Block::Zero(), Block::Zero(), Block::Zero(), Block::Zero()};
  std::array<double, 27> sums_{};
  int size_ = 0, count_ = 0;
};

}  // namespace

bool ConicModel::Refine(const float* weights, Value* value) const {
  ConicNormalEquations equations(*value);
  for (int i = 0; i < NumData(); ++i) {
    if (weights[i] > 0.0f) equations.Add(Point(i), static_cast<double>(weights[i]));
  }
  Vector6d step;
  if (equations.count() < kMinSamples || !equations.Solve(&step)) return false;
  const Eigen::Map<const Vector6d> q(value->data());
  constexpr int kMaxHalvings = 4;
  for (int i = 0; i <= kMaxHalvings; ++i, step *= 0.5) {
    Value moved;
    Eigen::Map<Vector6d>(moved.data()) = q + step;
    if (!Normalize(&moved)) continue;
    *value = moved;
    return true;
  }
  return false;
}

}  // namespace circline
