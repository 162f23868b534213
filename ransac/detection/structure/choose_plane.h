// The plane that most of the detected evidence agrees on. Internal: not installed.
#ifndef CIRCLINE_RANSAC_DETECTION_STRUCTURE_CHOOSE_PLANE_H_
#define CIRCLINE_RANSAC_DETECTION_STRUCTURE_CHOOSE_PLANE_H_

#include <Eigen/Core>
#include <array>
#include <utility>
#include <vector>

#include "circline/ransac/detection/structure/assemble_observations.h"

namespace circline {

// A pencil, and its direction as the tests take it.
struct PlacedPencil : DetectedPencil {
  explicit PlacedPencil(DetectedPencil pencil)
      : DetectedPencil(std::move(pencil)), along(*observation.fit) {}
  PlacedPencil(DetectedPencil pencil, const Eigen::Vector3d& direction)
      : DetectedPencil(std::move(pencil)), along{direction, Eigen::Matrix3d::Zero()} {}
  UncertainDirection along;
  bool of_grid = false;  // A row or column of circles.
  bool spans = false;    // One of the two that the plane was chosen by.
};

// A plane that some of the evidence agrees on.
struct Plane {
  UncertainDirection normal;
  std::array<int, 2> pencils{-1, -1};  // That span it; -1: circles alone.
  std::vector<int> circles;
  double support_px = 0.0;
};

// The lines of pencils come from the whole photo, and are those that are exactly parallel. The
// region in which two pencils form corners may be one thing: then all its lines count, bent or not,
// and no others. Fits both pencils to the lines of that region. False, and nothing changed, where
// less than 70 % of either pencil is left: two directions of a street, say.
bool RefitWhereTheyMeet(const std::vector<DetectedLine>& lines, std::array<DetectedPencil, 2>* pair,
                        double diagonal_px = kUsualDiagonalPx);

// The plane with most support of circles alone; where it is likelier that they agree by accident,
// that of the best supported circle.
Plane PlaneOfCircles(const AssemblyOptions& options, const std::vector<CircleEvidence>& circles);

// The plane with most support: of two pencils and the circles that agree, or that of circles alone.
// Fits the two pencils again, to where they meet; drops those that prove to be another one. `lines`
// are those that the pencils' members index.
Plane ChoosePlane(const AssemblyOptions& options, const std::vector<DetectedLine>& lines,
                  const std::vector<CircleEvidence>& circles, const Plane& of_circles,
                  std::vector<PlacedPencil>* pencils);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_STRUCTURE_CHOOSE_PLANE_H_
