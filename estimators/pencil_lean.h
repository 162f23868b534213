// How the walls that carry a pencil's lines, each of which leans in a way of its own, turn its
// direction. Internal: not installed, but shown to circline_refine.
#ifndef CIRCLINE_ESTIMATORS_PENCIL_LEAN_H_
#define CIRCLINE_ESTIMATORS_PENCIL_LEAN_H_

#include <Eigen/Core>

#include "circline/estimators/export.h"
#include "circline/estimators/observations.h"

namespace CIRCLINE_EXPORT circline {

// Half of all axes, of boards and doors, are exact; the walls of old houses lean, with a standard
// deviation of so many times NoiseModel::pencil_axis_rad. On streets (scene-lund, -more) and a bent
// sheet (robot10x10), of 1 to 3.
constexpr double kLeaning = 1.5;

// Covariance, rank 2, of a fitted direction against the axis that it is taken for, in units of
// NoiseModel::pencil_axis_rad squared: that of walls that lean, as no photo tells which do. Lines
// whose planes make small angles about the direction lie on one wall and lean alike; the fit takes
// leans of different walls for convergence, and turns by a multiple of them where the walls are
// seen under a small angle: two walls left and right of the view, 20 degrees off its middle, that
// lean apart by one unit each turn their direction by two. Without lines, of one wall.
Eigen::Matrix3d LeanShape(const PencilObservation& pencil);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_PENCIL_LEAN_H_
