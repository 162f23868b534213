// How probably pencils that were taken for axes are at right angles, seen through a camera whose
// focal length is unknown. Internal: not installed.
//
// At a known focal length two directions are hardly ever square by accident. At an unknown one many
// are so at some focal length, and the estimate takes that one: what tells is whether their lines
// meet, as those of one thing do, whether that focal length is a likely one (diamond tiles are
// square at one that is not, if at any), whether a third direction is square to both at the same
// one, and whether one more of their plane has them for hexagonal tiles at some.
#ifndef CIRCLINE_RANSAC_DETECTION_STRUCTURE_JUDGE_AXES_H_
#define CIRCLINE_RANSAC_DETECTION_STRUCTURE_JUDGE_AXES_H_

#include <limits>

#include "circline/ransac/detection/structure/assemble_observations.h"
#include "circline/ransac/detection/structure/choose_plane.h"

namespace circline {

// Fills PencilObservation::axis_probability of y, and of z where there is one: null = none. 1 where
// it is 0.99 or more. `options` are those of a camera whose focal length was looked for. `skew`: a
// further direction in the plane of x and y; null = none. `z_ratio`: ThirdPencil::ratio where z was
// looked for at right angles to both at that focal length; infinity: it was found by itself.
void JudgeAxes(const AssemblyOptions& options, const PlacedPencil& x, PlacedPencil* y,
               PlacedPencil* z, const PlacedPencil* skew = nullptr,
               double z_ratio = std::numeric_limits<double>::infinity());

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_STRUCTURE_JUDGE_AXES_H_
