#include "circline/ransac/detection/lines/line_pieces.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "circline/estimators/line_moments.h"

namespace circline {
namespace {

// A piece starts from this many consecutive points on one line, and has at least this length:
// below, any smooth curve passes for straight.
constexpr int kSeedPoints = 9;
constexpr double kMinPiecePx = 10.0;
// Largest sagitta of what still counts as straight, pixels.
constexpr double kMaxSagittaPx = 0.3;
// All but straight: a sagitta of up to this many pixels, and this share of the length.
constexpr double kMaxBentPx = 1.2;
constexpr double kMaxBentShare = 0.018;
// So many points in a row off the line end a piece; fewer are noise.
constexpr int kMaxMisses = 2;

using Eigen::Vector2d;
using Eigen::Vector3d;

class PieceCutter {
 public:
  PieceCutter(const LineEdges& edges, std::vector<LinePiece>* straight,
              std::vector<LinePiece>* bent)
      : edges_(edges), straight_(straight), bent_(bent) {}

  // Greedily, from the first point on: seed, grow, go on behind.
  void CutChain(const EdgeChain& chain) {
    int i = chain.begin;
    while (i + kSeedPoints <= chain.end) {
      LinePiece piece;
      if (!Seed(i, &piece)) {
        i += 2;
        continue;
      }
      Grow(chain, &piece);
      Keep(&piece);
      i = piece.end;
    }
  }

 private:
  bool Seed(int begin, LinePiece* piece) {
    if (!edges_.Usable(begin)) return false;
    moments_ = LineMoments(edges_.X(begin).x);
    for (int i = begin; i < begin + kSeedPoints; ++i) {
      if (!edges_.Usable(i)) return false;
      moments_.Add(edges_.X(i).x);
    }
    piece->begin = begin;
    piece->end = begin + kSeedPoints;
    piece->line = moments_.Line();
    for (int i = piece->begin; i < piece->end; ++i) {
      // Seeds are stricter than growth: they carry no average yet.
      if (edges_.Distance(i, piece->line) > 0.75 * kMaxLineDistancePx) return false;
    }
    return true;
  }

  void Grow(const EdgeChain& chain, LinePiece* piece) {
    int misses = 0, refit_at = kSeedPoints + 2;
    for (int i = piece->end; i < chain.end && edges_.Usable(i) && misses <= kMaxMisses; ++i) {
      if (edges_.Distance(i, piece->line) > kMaxLineDistancePx) {
        ++misses;
        continue;
      }
      misses = 0;
      moments_.Add(edges_.X(i).x);
      piece->end = i + 1;
      if (moments_.count() < refit_at) continue;
      piece->line = moments_.Line();
      refit_at = moments_.count() + std::max(2, moments_.count() / 8);
    }
    piece->line = moments_.Line();
  }

  void Keep(LinePiece* piece) {
    piece->length_px = (edges_.Pixel(piece->end - 1) - edges_.Pixel(piece->begin)).norm();
    const int middle = (piece->begin + piece->end) / 2;
    piece->gradient = edges_.map().points[static_cast<std::size_t>(middle)].Normal();
    if (piece->length_px < kMinPiecePx) return;
    const double sagitta = SagittaPx(*piece);
    if (sagitta > std::max(kMaxSagittaPx, std::min(kMaxBentPx, kMaxBentShare * piece->length_px))) {
      return;
    }
    (sagitta <= kMaxSagittaPx ? straight_ : bent_)->push_back(*piece);
  }

  // The middle half of the points on one side of the line and the ends on the other is a curve.
  double SagittaPx(const LinePiece& piece) const {
    const int n = piece.end - piece.begin;
    double middle = 0.0, ends = 0.0;
    int num_middle = 0, num_ends = 0;
    for (int k = 0; k < n; ++k) {
      const double d = LineDistancePx(edges_.X(piece.begin + k), piece.line);
      if (std::abs(d) > kMaxLineDistancePx) continue;
      if (4 * k >= n && 4 * k < 3 * n) {
        middle += d;
        ++num_middle;
      } else {
        ends += d;
        ++num_ends;
      }
    }
    if (num_middle == 0 || num_ends == 0) return std::numeric_limits<double>::infinity();
    // For a parabola the two means differ by half its sagitta.
    return 2.0 * std::abs(middle / num_middle - ends / num_ends);
  }

  const LineEdges& edges_;
  std::vector<LinePiece>* straight_;
  std::vector<LinePiece>* bent_;
  LineMoments moments_;
};

}  // namespace

void CutIntoPieces(const LineEdges& edges, std::vector<LinePiece>* straight,
                   std::vector<LinePiece>* bent) {
  PieceCutter cutter(edges, straight, bent);
  for (const EdgeChain& chain : edges.map().chains) cutter.CutChain(chain);
}

}  // namespace circline
