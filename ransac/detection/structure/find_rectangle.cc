#include "circline/ransac/detection/structure/find_rectangle.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "circline/estimators/basics.h"
#include "circline/estimators/vanishing_point.h"
#include "circline/ransac/detection/lines/segment_meetings.h"
#include "circline/ransac/detection/structure/box_edge.h"
#include "circline/ransac/detection/structure/uncertain_direction.h"

namespace circline {
namespace {

using Eigen::Vector2d;

// Shorter sides make too many corners by accident, and tell little: a share of the diagonal.
constexpr double kMinSide = 40.0 / kUsualDiagonalPx;
// A side is seen over this share of its length.
constexpr double kMinSeen = 0.7;
// Lines stop short of a corner by so much on the average, a share of the diagonal; those of other
// things by anything up to kMaxCornerGap.
constexpr double kMeanGap = 3.0 / kUsualDiagonalPx;
// Least logarithm of the odds that the eight ends of the sides are so near to their corners, beyond
// that of the number of four lines that form corners in a ring. 300 drawings of 20 to 119 lines
// that lie any way have no rectangle, and 80 photographs of nature (Debian's packages); of sheets
// that are drawn among 30 such lines 96 of 100 are found.
constexpr double kMinRingLogOdds = 4.0;
// A focal length that is a guess is searched over so many of its standard deviations.
constexpr double kFocalReach = 2.0;
constexpr int kFocalSteps = 50;

// Four lines in a ring: each forms a corner with the next one.
struct Ring {
  std::array<std::size_t, 4> sides;
  double perimeter = 0.0, log_odds = 0.0;
};

class RectangleSearch {
 public:
  RectangleSearch(const AssemblyOptions& options, const std::vector<DetectedLine>& lines)
      : options_(options),
        lines_(lines),
        corners_(
            FindCorners(lines, options.diagonal_px, kMinSeen * kMinSide * options.diagonal_px)) {}

  std::optional<std::array<DetectedPencil, 2>> Largest() {
    std::vector<Ring> rings = Rings();
    const double least = kMinRingLogOdds + std::log(static_cast<double>(rings.size() + 1));
    std::stable_sort(rings.begin(), rings.end(),
                     [](const Ring& a, const Ring& b) { return a.perimeter > b.perimeter; });
    for (const Ring& ring : rings) {
      if (ring.log_odds < least) continue;
      std::array<DetectedPencil, 2> pencils;
      if (!Pair(ring, 0, &pencils[0]) || !Pair(ring, 1, &pencils[1]) ||
          !CanBeRight(*pencils[0].observation.fit, *pencils[1].observation.fit))
        continue;
      if (pencils[1].support_px > pencils[0].support_px) std::swap(pencils[0], pencils[1]);
      return pencils;
    }
    return std::nullopt;
  }

 private:
  // All, each once: it starts with the line of the lowest index, and the second is before the last.
  std::vector<Ring> Rings() const {
    std::vector<Ring> rings;
    for (std::size_t i = 0; i < lines_.size(); ++i) {
      for (const std::size_t j : corners_[i]) {
        for (const std::size_t k : corners_[j]) {
          if (j < i || k <= i) continue;
          for (const std::size_t l : corners_[k]) {
            const auto& of_l = corners_[l];
            if (l <= j || std::find(of_l.begin(), of_l.end(), i) == of_l.end()) continue;
            Ring ring{{i, j, k, l}};
            if (Judge(&ring)) rings.push_back(ring);
          }
        }
      }
    }
    return rings;
  }

  // False where the corners are no convex quadrilateral with sides that are seen.
  bool Judge(Ring* ring) const {
    std::array<Vector2d, 4> at;  // Where each side ends, and the next one begins.
    for (std::size_t k = 0; k < 4; ++k)
      at[k] = Crossing(lines_[ring->sides[k]].ends, lines_[ring->sides[(k + 1) % 4]].ends);
    const double unit = kMeanGap * options_.diagonal_px;
    double turn = 0.0;
    for (std::size_t k = 0; k < 4; ++k) {
      const Vector2d &from = at[(k + 3) % 4], &to = at[k], &next = at[(k + 1) % 4];
      const double cross = Cross(to - from, next - to), length = (to - from).norm();
      if (cross * turn < 0.0 || !(length >= kMinSide * options_.diagonal_px)) return false;
      turn = cross;
      const DetectedLine& side = lines_[ring->sides[k]];
      if (side.length_px < kMinSeen * length) return false;
      ring->perimeter += length;
      for (const Vector2d& corner : {from, to}) {
        const double gap = std::min((side.ends[0] - corner).norm(), (side.ends[1] - corner).norm());
        ring->log_odds += std::log(kMaxCornerGap / kMeanGap) - gap / unit;
      }
    }
    return true;
  }

  // Two opposite sides.
  bool Pair(const Ring& ring, std::size_t first, DetectedPencil* pencil) const {
    std::vector<int> members;
    std::vector<LineFit> fits;
    for (const std::size_t i : {std::min(ring.sides[first], ring.sides[first + 2]),
                                std::max(ring.sides[first], ring.sides[first + 2])}) {
      members.push_back(static_cast<int>(i));
      fits.push_back(WornEdge(lines_[i]));
    }
    VanishingPointFit fit;
    if (!FitVanishingPoint(fits, &fit).ok()) return false;
    *pencil = MakePencil(lines_, members, fits, fit.direction);
    pencil->observation.fit = fit;
    return true;
  }

  // Whether these are likelier at right angles than at any, at the focal length of the camera or
  // one that it may have.
  bool CanBeRight(const UncertainDirection& a, const UncertainDirection& b) const {
    if (!(options_.camera.log_focal > 0.0)) return RightAngle(a, b).LogOdds() > 0.0;
    for (int k = -kFocalSteps; k <= kFocalSteps; ++k) {
      const double log_focal =
          options_.prior_log_focal + kFocalReach * options_.focal_sigma * k / kFocalSteps;
      const CameraError camera{options_.camera.middle_rad * std::exp(-log_focal), 0.0};
      if (RightAngle(Refocus(a, log_focal), Refocus(b, log_focal), camera).LogOdds() > 0.0)
        return true;
    }
    return false;
  }

  const AssemblyOptions& options_;
  const std::vector<DetectedLine>& lines_;
  const std::vector<std::vector<std::size_t>>
      corners_;  // Of each line: those that it forms one with.
};

}  // namespace

std::optional<std::array<DetectedPencil, 2>> FindRectangle(const AssemblyOptions& options,
                                                           const std::vector<DetectedLine>& lines) {
  return RectangleSearch(options, lines).Largest();
}

}  // namespace circline
