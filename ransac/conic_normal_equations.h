// One step of least squares for a conic. Internal: not installed.
#ifndef CIRCLINE_RANSAC_CONIC_NORMAL_EQUATIONS_H_
#define CIRCLINE_RANSAC_CONIC_NORMAL_EQUATIONS_H_

#include <Eigen/Core>
#include <array>

#include "circline/estimators/conic.h"
#include "circline/ransac/conic_model.h"

namespace circline {

// Gauss-Newton on r = v / (2 |g|), v = q . m and g the gradient per pixel (halved), of the
// coefficients q of a conic. Points are taken in blocks, so that the compiler can work on several
// at a time: half the time of point by point.
class ConicNormalEquations {
 public:
  explicit ConicNormalEquations(const ConicModel::Value& q) : q_(q) {}

  void Add(const Eigen::Vector2d& x, const std::array<double, 4>& x_from_pixel, double weight) {
    x_[size_] = x.x();
    y_[size_] = x.y();
    for (std::size_t k = 0; k < 4; ++k) j_[k][size_] = x_from_pixel[k];
    w_[size_] = weight;
    if (++size_ == kBlock) Flush();
    ++count_;
  }

  int count() const { return count_; }

  // The step of q that minimises the linearised cost, orthogonal to q: r does not change with the
  // scale of q, so q q^T closes the rank. False if there is none.
  bool Step(Vector6d* step);

 private:
  static constexpr int kBlock = 32;
  using Block = Eigen::Array<double, kBlock, 1>;

  void Flush();

  ConicModel::Value q_;
  Block x_, y_, w_;
  std::array<Block, 4> j_;
  std::array<double, 27> sums_{};
  int size_ = 0, count_ = 0;
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_CONIC_NORMAL_EQUATIONS_H_
