// One step of least squares for a conic.
#include <Eigen/Dense>
#include <array>
#include <cstddef>

#include "circline/estimators/conic.h"
#include "circline/ransac/conic_model.h"

namespace circline {
namespace {

// x^2 + y^2 - 1, as ConicModel::Value has it.
Vector6d UnitCircle() { return (Vector6d() << 1.0, 0.0, 1.0, 0.0, 0.0, -1.0).finished(); }

// Takes a conic to the unit circle: u = L^T (x - center), L L^T its quadratic part over what it is
// at its center. No ellipse, no map: it is not finite.
Eigen::Matrix3d CircleFromConic(const Eigen::Matrix3d& conic) {
  const Eigen::Matrix2d quadratic = conic.topLeftCorner<2, 2>();
  const Eigen::Vector2d center = -quadratic.inverse() * conic.topRightCorner<2, 1>();
  const double at_center = conic(2, 2) + conic.topRightCorner<2, 1>().dot(center);
  const Eigen::Matrix2d L = (-quadratic / at_center).llt().matrixL();
  Eigen::Matrix3d map = Eigen::Matrix3d::Identity();
  map.topLeftCorner<2, 2>() = L.transpose();
  map.topRightCorner<2, 1>() = -L.transpose() * center;
  return map;
}

// Gauss-Newton on r = v / (2 |g|), g the gradient per pixel (halved) of a conic's v, where it is
// the unit circle: v = |u|^2 - 1. There its coefficients are told apart as well as the points
// allow, whatever its shape and size, and floats do. Points are worked off in blocks, so that the
// compiler can work on several at a time.
class CircleNormalEquations {
 public:
  explicit CircleNormalEquations(const Eigen::Matrix3d& circle_from_x)
      : map_(circle_from_x.cast<float>()) {}

  void Add(const CalibratedPoint& p, float weight) {
    x_[size_] = static_cast<float>(p.x.x());
    y_[size_] = static_cast<float>(p.x.y());
    for (std::size_t k = 0; k < 4; ++k) j_[k][size_] = static_cast<float>(p.x_from_pixel[k]);
    w_[size_] = weight;
    if (++size_ == kBlock) SumBlock();
    ++count_;
  }

  int count() const { return count_; }

  // The step of the coefficients that minimises the linearised cost, orthogonal to them: r does not
  // change with their scale, so they close the rank. False if there is none.
  bool Solve(Vector6d* step) {
    if (size_ > 0) SumBlock();
    Matrix6d H;
    Vector6d gradient;
    std::size_t k = 0;
    for (int m = 0; m < 6; ++m) {
      for (int n = m; n < 6; ++n) H(m, n) = H(n, m) = sums_[k++];
      gradient[m] = sums_[k++];
    }
    const double trace = H.trace();
    H += trace / 3.0 * UnitCircle() * UnitCircle().transpose();
    H.diagonal().array() += 1e-12 * trace;
    *step = -H.ldlt().solve(gradient);
    return step->allFinite();
  }

 private:
  static constexpr int kBlock = 32;
  using Block = Eigen::Array<float, kBlock, 1>;

  void SumBlock() {
    constexpr float kTinySquare = 1e-20f;  // Keeps 0 / 0 out of the centre of the circle.
    // What is not filled are points of an earlier block or the first ones below.
    w_.tail(kBlock - size_).setZero();
    size_ = 0;
    const Block x = map_(0, 0) * x_ + map_(0, 1) * y_ + map_(0, 2),
                y = map_(1, 1) * y_ + map_(1, 2);
    // Of u by the pixel: as x_from_pixel.
    const std::array<Block, 4> j{map_(0, 0) * j_[0] + map_(0, 1) * j_[2],
                                 map_(0, 0) * j_[1] + map_(0, 1) * j_[3], map_(1, 1) * j_[2],
                                 map_(1, 1) * j_[3]};
    const Block gu = j[0] * x + j[2] * y, gv = j[1] * x + j[3] * y;
    const Block inverse = 0.5f / (gu * gu + gv * gv + kTinySquare).sqrt();
    std::array<Block, 7> row;  // Derivatives, and the residual.
    row[6] = (x * x + y * y - 1.0f) * inverse;
    const Block s = 4.0f * row[6] * inverse * inverse;
    const Block hx = s * (j[0] * gu + j[1] * gv), hy = s * (j[2] * gu + j[3] * gv);
    row[0] = x * (x * inverse - hx);
    row[1] = 2.0f * x * y * inverse - hx * y - hy * x;
    row[2] = y * (y * inverse - hy);
    row[3] = 2.0f * x * inverse - hx;
    row[4] = 2.0f * y * inverse - hy;
    row[5] = inverse;
    std::size_t k = 0;
    for (std::size_t m = 0; m < 6; ++m) {
      const Block weighted = w_ * row[m];
      for (std::size_t n = m; n < 7; ++n)
        sums_[k++] += static_cast<double>((weighted * row[n]).sum());
    }
  }

  Eigen::Matrix3f map_;
  Block x_ = Block::Zero(), y_ = Block::Zero(), w_;
  std::array<Block, 4> j_{Block::Ones(), Block::Ones(), Block::Ones(), Block::Ones()};
  std::array<double, 27> sums_{};
  int size_ = 0, count_ = 0;
};

}  // namespace

bool ConicModel::Refine(const float* weights, Value* value) const {
  const Eigen::Matrix3d circle_from_x = CircleFromConic(ToMatrix(*value));
  if (!circle_from_x.allFinite()) return false;
  CircleNormalEquations equations(circle_from_x);
  for (int i = 0; i < NumData(); ++i) {
    if (weights[i] > 0.0f) equations.Add(Point(i), weights[i]);
  }
  Vector6d step;
  if (equations.count() < kMinSamples || !equations.Solve(&step)) return false;
  constexpr int kMaxHalvings = 4;
  for (int i = 0; i <= kMaxHalvings; ++i, step *= 0.5) {
    Value moved;
    Eigen::Map<Vector6d>(moved.data()) = UnitCircle() + step;
    moved = ToValue(TransformConic(ToMatrix(moved), circle_from_x));
    if (!Normalize(&moved)) continue;
    *value = moved;
    return true;
  }
  return false;
}

}  // namespace circline
