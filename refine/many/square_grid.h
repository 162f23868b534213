// Lines of a board of equal squares, as a chessboard has them: what they say beside their
// directions. Internal: not installed.
#ifndef CIRCLINE_REFINE_MANY_SQUARE_GRID_H_
#define CIRCLINE_REFINE_MANY_SQUARE_GRID_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <map>
#include <optional>
#include <utility>

#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"

namespace circline {

// Of a square: how far what is on a grid may be off its place while the camera is not known well.
constexpr double kLooseOnGrid = 0.02;

// Which lines of a photo are on the grid of its board.
struct SquareGrid {
  // The line's whole number: squares along Y of a line along X, and the other way round. From 0.
  // Keys: pencil and line, as Observations has them.
  std::map<std::pair<std::size_t, std::size_t>, int> places;
  int width = 0;  // Of the board as it is seen, squares: the larger one of both.
  // Takes the line of this place across an axis away.
  void Remove(const Observations& photo, int axis, int place);
  // Whether it has enough lines along either axis to say anything.
  bool HasBothAxes(const Observations& photo) const;
  // Of the board: the unit is a square, the origin where the lines 0 meet.
  CameraPose cam_from_board;
};

// Across which axis of the world a pencil of the board has its lines: 1, Y, where it runs along X.
int AxisAcross(const PencilObservation& pencil);

// The grid of the pencils along X and Y of a fitted photo (Prepare), at this rotation
// cam_from_world and with the camera as it is: the distance that explains most lines as whole
// numbers of it, along either axis the same, all others as anywhere. Z faces the camera, as
// ResolveWorld has it. None where that might be chance, or the lines along one axis are a distance
// of their own apart.
std::optional<SquareGrid> FindSquareGrid(const Observations& photo,
                                         const Eigen::Matrix3d& rotation);

// The middle of a line of the world's plane against its place on the grid: rotation, translation,
// direction, line as those of its DirectionLineCost, by how much the board is off there (1,
// squares), and the camera. `camera`, `fit`: as given to that cost; `middle`: of its points,
// calibrated; `place` squares along `axis` (0: X, 1: Y), with this standard deviation.
ceres::CostFunction* NewGridLinePrior(const Camera& camera, const Eigen::Vector3d& fit,
                                      const Eigen::Vector2d& middle, bool line_deviates, int axis,
                                      int place, double sigma);

}  // namespace circline

#endif  // CIRCLINE_REFINE_MANY_SQUARE_GRID_H_
