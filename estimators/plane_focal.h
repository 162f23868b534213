// The unknown focal length of one photo from all that one plane shows: a circle and a pencil,
// circles of one size, a lattice of these. Coordinates, units and refusals as in focal_length.h.
#ifndef CIRCLINE_ESTIMATORS_PLANE_FOCAL_H_
#define CIRCLINE_ESTIMATORS_PLANE_FOCAL_H_

#include <array>
#include <vector>

#include "circline/estimators/conic_fit.h"
#include "circline/estimators/export.h"
#include "circline/estimators/focal_length.h"
#include "circline/estimators/vanishing_point.h"

namespace CIRCLINE_EXPORT circline {

// What of one plane is seen.
struct PlaneEvidence {
  std::vector<const ConicFit*> circles;  // One or more, the best-measured first.
  // One for each circle, in any one unit, as 1 and 1 for circles of one size; empty: not known.
  std::vector<double> radii;
  std::vector<const VanishingPointFit*> pencils;  // Of lines of the plane.
  bool orthogonal_pencils = false;  // The first two are: the rows and columns of a lattice.
  // Standard deviations: of a pencil against the plane and its right angle, radians; of log radius.
  double pencil_sigma = 0.0, radius_sigma = 0.0;
};

// For a focal length and a normal every circle, taken back to the plane, has a shape (two numbers,
// 0 for a circle) and a size, and every pencil an angle with the plane: their least squares,
// weighted by the covariances, over focal length, normal and unit of the radii. Compared at 40
// focal lengths from `min_focal` to `max_focal` (those of fields of view of 120 and 10 degrees are
// usual) on both planes of the first circle, then minimised over all unknowns from every minimum of
// these, to 1e-12.
//
// Writes up to four solutions, the lowest chi2 first, without those that chi2 excludes (by more
// than 60, where a unit is chi2 per degree of freedom if that is above 1). Refuses one circle
// alone, and minima at the ends of the range. Two circles of any radii are allowed; see
// FocalFromCoplanarCircles. 0.2 ms for a circle and a pencil, 1.4 ms for 12 circles and two
// pencils.
int FocalFromPlane(const PlaneEvidence& evidence, double min_focal, double max_focal,
                   std::array<FocalSolution, 4>* solutions, FocalRefusal* why = nullptr);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_PLANE_FOCAL_H_
