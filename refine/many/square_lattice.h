// Circles on a grid of equal squares, as those of a calibration sheet lie: what they say beside
// their contours. Internal: not installed.
#ifndef CIRCLINE_REFINE_MANY_SQUARE_LATTICE_H_
#define CIRCLINE_REFINE_MANY_SQUARE_LATTICE_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <map>
#include <string>
#include <utility>

#include "circline/refine/many/adjust_layout.h"

namespace circline {

// Which circles of a world have their centres on one, by place (column, row); of several about one
// centre the largest.
struct SquareLattice {
  std::map<std::pair<int, int>, std::string> circles;

  // Fewer might be on one by chance.
  bool HasEnough() const { return circles.size() >= 6; }
  // Squares, the longer side.
  int Width() const;
  // Place (i, j) lies at origin + i side + j (side, turned by 90 degrees): the least squares of its
  // circles that `layout` has. False where these are too few, or all at one place.
  bool Fit(const Layout& layout, Eigen::Vector2d* origin, Eigen::Vector2d* side) const;
};

// The lattice on which most circles lie, each to 2 % of a square, the others anywhere; half of the
// places may be empty. Without circles where that might be chance.
SquareLattice FindSquareLattice(const Layout& layout);

// A circle's centre against its place: centre (2), origin (2), side (2); the deviation of either
// coordinate in the world's unit.
ceres::CostFunction* NewLatticePrior(const std::pair<int, int>& place, double sigma);

}  // namespace circline

#endif  // CIRCLINE_REFINE_MANY_SQUARE_LATTICE_H_
