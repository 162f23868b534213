// The straight pieces of edge chains, of which lines are joined. Internal: not installed.
#ifndef CIRCLINE_RANSAC_DETECTION_LINES_LINE_PIECES_H_
#define CIRCLINE_RANSAC_DETECTION_LINES_LINE_PIECES_H_

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/line.h"
#include "circline/ransac/detection/calibrated_edges.h"
#include "circline/ransac/detection/edges.h"

namespace circline {

// Largest distance of an edge point to its line, pixels.
constexpr double kMaxLineDistancePx = 0.8;

// Unit direction of a line.
inline Eigen::Vector2d Along(const Eigen::Vector3d& line) { return {line.y(), -line.x()}; }

// A run of edge points on one line.
struct LinePiece {
  int begin = 0, end = 0;  // Points of the map (all usable, in order).
  Eigen::Vector3d line;    // Calibrated; unit normal.
  double length_px = 0.0;
  Eigen::Vector2d gradient;  // At its middle, unit.
};

// The edge points of a photo as lines need them: calibrated, but for those that belong to something
// else (`skip`, optional, one per point).
class LineEdges {
 public:
  // All must outlive it.
  LineEdges(const EdgeMap& map, const Camera& camera, const std::vector<std::uint8_t>* skip)
      : map_(map), skip_(skip), calibrated_(map, camera) {}

  // Of usable points.
  CalibratedPoint X(int i) const {
    CalibratedPoint point;
    calibrated_.Get(i, &point);
    return point;
  }
  Eigen::Vector2d Pixel(int i) const { return map_.points[static_cast<std::size_t>(i)].Position(); }
  bool Usable(int i) const {
    if (skip_ != nullptr && (*skip_)[static_cast<std::size_t>(i)]) return false;
    CalibratedPoint point;
    return calibrated_.Get(i, &point);
  }
  double Distance(int i, const Eigen::Vector3d& line) const {
    return std::abs(LineDistancePx(X(i), line));
  }
  // Where a piece lies along a line.
  std::pair<double, double> Range(const Eigen::Vector3d& line, const LinePiece& piece) const {
    const Eigen::Vector2d along = Along(line);
    return std::minmax({along.dot(X(piece.begin).x), along.dot(X(piece.end - 1).x)});
  }
  const EdgeMap& map() const { return map_; }

 private:
  const EdgeMap& map_;
  const std::vector<std::uint8_t>* skip_;
  mutable CalibratedEdges calibrated_;  // Remembers what it was asked.
};

// Where pieces begin, calibrated: all are compared with all lines, in blocks of single precision,
// which Eigen turns into vectors.
class PieceBeginnings {
 public:
  PieceBeginnings(const LineEdges& edges, const std::vector<LinePiece>& pieces, double reach_px)
      : x_(pieces.size()), y_(pieces.size()), reach_(pieces.size()) {
    for (Eigen::Index i = 0; i < reach_.size(); ++i) {
      const CalibratedPoint first = edges.X(pieces[static_cast<std::size_t>(i)].begin);
      const double scale = Eigen::Map<const Eigen::Vector4d>(first.x_from_pixel.data()).norm();
      const double rounding = 1e-5 * (1.0 + first.x.cwiseAbs().sum());
      x_[i] = static_cast<float>(first.x.x());
      y_[i] = static_cast<float>(first.x.y());
      reach_[i] = static_cast<float>(1.001 * reach_px * scale + rounding);
    }
  }

  Eigen::Index size() const { return reach_.size(); }
  bool Has(Eigen::Index i) const { return reach_[i] != kNone; }
  void Remove(Eigen::Index i) { reach_[i] = kNone; }

  // The first, from i on, within its reach of a line of unit normal, or all but: rounding
  // leaves none out. size() if there is none.
  Eigen::Index NextNear(const Eigen::Vector3d& line, Eigen::Index i) const {
    constexpr Eigen::Index kBlock = 32;
    const Eigen::Vector3f l = line.cast<float>();
    const auto beyond = (l.x() * x_ + l.y() * y_ + l.z()).abs() - reach_;
    while (i + kBlock <= size() && beyond.segment<kBlock>(i).minCoeff() > 0.0F) i += kBlock;
    while (i < size() && beyond[i] > 0.0F) ++i;
    return i;
  }

 private:
  static constexpr float kNone = -1.0F;  // Nothing is that near.

  Eigen::ArrayXf x_, y_, reach_;
};

// Cuts all chains into pieces that are straight, and some that are all but straight (`bent`).
void CutIntoPieces(const LineEdges& edges, std::vector<LinePiece>* straight,
                   std::vector<LinePiece>* bent);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_LINES_LINE_PIECES_H_
