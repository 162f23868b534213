// Where straight pieces of edges begin, to find those that may continue a line. Internal: not
// installed.
#ifndef CIRCLINE_RANSAC_DETECTION_PIECE_BEGINNINGS_H_
#define CIRCLINE_RANSAC_DETECTION_PIECE_BEGINNINGS_H_

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/export.h"

namespace CIRCLINE_EXPORT circline {

// The first points of pieces, calibrated. All are compared with all lines: in blocks of single
// precision, which the compiler turns into vectors.
class PieceBeginnings {
 public:
  // A beginning is near a line up to this far off, pixels.
  explicit PieceBeginnings(double reach_px) : reach_px_(reach_px) {}

  // The first point of a further piece.
  void Add(const CalibratedPoint& first) {
    const std::array<double, 4>& j = first.x_from_pixel;
    const double square = j[0] * j[0] + j[1] * j[1] + j[2] * j[2] + j[3] * j[3];
    const double rounding = 1e-5 * (1.0 + first.x.cwiseAbs().sum());
    if (size_ % kBlock == 0) {
      x_.resize(size_ + kBlock, 0.0F);
      y_.resize(size_ + kBlock, 0.0F);
      reach_.resize(size_ + kBlock, kNone);
    }
    x_[size_] = static_cast<float>(first.x.x());
    y_[size_] = static_cast<float>(first.x.y());
    reach_[size_++] = static_cast<float>(1.001 * reach_px_ * std::sqrt(square) + rounding);
  }

  // Whether the i-th is still there: Remove takes it out.
  bool Has(std::size_t i) const { return reach_[i] != kNone; }
  void Remove(std::size_t i) { reach_[i] = kNone; }

  // The first, from i on, that is near a line of unit normal, or all but near: rounding leaves none
  // out. size() if there is none.
  std::size_t NextNear(const Eigen::Vector3d& line, std::size_t i) const {
    const Eigen::Vector3f l = line.cast<float>();
    while (i < size_) {
      const std::size_t block_end = i - i % kBlock + kBlock;
      if (AnyNear(l, block_end - kBlock)) {
        for (; i < block_end; ++i) {
          if (IsNear(l, i)) return i;
        }
      }
      i = block_end;
    }
    return size_;
  }
  // How many were added.
  std::size_t size() const { return size_; }

 private:
  static constexpr std::size_t kBlock = 32;
  static constexpr float kNone = -1.0F;  // Nothing is that near.

  bool IsNear(const Eigen::Vector3f& line, std::size_t i) const {
    return std::abs(line.x() * x_[i] + line.y() * y_[i] + line.z()) <= reach_[i];
  }
  bool AnyNear(const Eigen::Vector3f& line, std::size_t begin) const {
    int near = 0;
    for (std::size_t i = begin; i < begin + kBlock; ++i) near |= IsNear(line, i) ? 1 : 0;
    return near != 0;
  }

  const double reach_px_;
  std::size_t size_ = 0;
  std::vector<float> x_, y_, reach_;  // Filled up to whole blocks.
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_PIECE_BEGINNINGS_H_
