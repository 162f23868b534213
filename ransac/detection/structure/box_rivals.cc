#include "circline/ransac/detection/structure/box_rivals.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <utility>

#include "circline/ransac/detection/structure/box_edge.h"
#include "circline/ransac/detection/structure/uncertain_direction.h"

namespace circline {
namespace {

// Evidence of a pencil that no box outweighs: six edges along two of its axes, at four each.
constexpr double kMostOddsOfABox = 24.0;

double LogOddsOf(const PlacedPencil& pencil, const std::vector<DetectedLine>& lines) {
  return LogOddsOfDirection(lines, pencil.members, pencil.along.direction);
}

// Logarithm of how much better the evidence of the two pencils is than that of the box, what they
// have in common left out; none where the box has both directions.
std::optional<double> LogOddsAgainst(const FoundBox& box, const std::vector<DetectedLine>& lines,
                                     const std::vector<PlacedPencil>& pencils,
                                     const std::array<int, 2>& pair) {
  std::array<double, 3> of_box = box.log_odds_along;
  double of_pencils = 0.0;
  bool is_other = false;
  for (const int i : pair) {
    const PlacedPencil& pencil = pencils[static_cast<std::size_t>(i)];
    bool is_axis = false;
    for (std::size_t k = 0; k < 3; ++k) {
      const Eigen::Vector3d axis = box.axes.col(static_cast<Eigen::Index>(k));
      if (!AreAlike(pencil.along.direction, axis)) continue;
      is_axis = true;
      of_box[k] = 0.0;
    }
    if (is_axis) continue;
    is_other = true;
    of_pencils += LogOddsOf(pencil, lines);
  }
  if (!is_other) return std::nullopt;
  return of_pencils - (of_box[0] + of_box[1] + of_box[2]);
}

}  // namespace

bool OutweighAnyBox(const std::vector<DetectedLine>& lines, const PlacedPencil& a,
                    const PlacedPencil& b) {
  return std::min(LogOddsOf(a, lines), LogOddsOf(b, lines)) >= kMostOddsOfABox;
}

bool YieldsToPencils(const FoundBox& box, const AssemblyOptions& options,
                     const std::vector<DetectedLine>& lines,
                     const std::vector<CircleEvidence>& circles, Plane* plane,
                     std::vector<PlacedPencil>* pencils) {
  if (plane->pencils[0] >= 0) {
    const std::optional<double> against = LogOddsAgainst(box, lines, *pencils, plane->pencils);
    return !against || *against >= 0.0;
  }
  if (plane->circles.size() != 1) return false;
  std::vector<PlacedPencil> fitted = *pencils;
  Plane spanned = ChoosePlane(options, lines, circles, Plane(), &fitted);
  if (spanned.pencils[0] < 0) return false;
  const PlacedPencil &a = fitted[static_cast<std::size_t>(spanned.pencils[0])],
                     &b = fitted[static_cast<std::size_t>(spanned.pencils[1])];
  if (!OutweighAnyBox(lines, a, b)) return false;
  const std::optional<double> against = LogOddsAgainst(box, lines, fitted, spanned.pencils);
  if (!against || *against < 0.0) return false;
  *plane = std::move(spanned);
  *pencils = std::move(fitted);
  return true;
}

}  // namespace circline
