// The plane that most of the detected evidence agrees on. Internal: not installed.
#ifndef CIRCLINE_RANSAC_DETECTION_CHOOSE_PLANE_H_
#define CIRCLINE_RANSAC_DETECTION_CHOOSE_PLANE_H_

#include <Eigen/Core>
#include <array>
#include <utility>
#include <vector>

#include "circline/ransac/detection/assemble_observations.h"

namespace circline {

// A pencil, and its direction as the tests take it.
struct PlacedPencil : DetectedPencil {
  explicit PlacedPencil(DetectedPencil pencil)
      : DetectedPencil(std::move(pencil)),
        direction{observation.fit->direction, observation.fit->covariance} {}
  PlacedPencil(DetectedPencil pencil, const Eigen::Vector3d& along)
      : DetectedPencil(std::move(pencil)), direction{along, Eigen::Matrix3d::Zero()} {}
  UncertainDirection direction;
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

// Whether a pencil's direction is that one, within 3 degrees.
bool IsNear(const PlacedPencil& pencil, const Eigen::Vector3d& direction);

class PlaneChooser {
 public:
  // All must outlive it.
  PlaneChooser(const AssemblyOptions& options, const std::vector<DetectedLine>& lines,
               const std::vector<CircleEvidence>& circles)
      : options_(options), lines_(lines), circles_(circles) {}

  // The plane with most support of circles alone; where it is likelier that they agree by accident,
  // that of the best supported circle.
  Plane OfCircles() const;

  // The plane with most support: of two pencils and the circles that agree, or that of circles
  // alone. Fits the two pencils again, to where they meet; drops those that prove to be another
  // one.
  Plane Choose(const Plane& of_circles, std::vector<PlacedPencil>* pencils) const;

 private:
  bool IsOfSolidIn(const Plane& plane, std::size_t i) const;
  void AddCircles(Plane* plane) const;
  Plane GrowFrom(const UncertainDirection& seed) const;
  UncertainDirection MeanNormal(const Plane& plane) const;
  double LogOdds(const UncertainDirection& normal) const;
  Plane Best(const Plane& of_circles, const std::vector<PlacedPencil>& pencils) const;
  bool Refit(Plane* plane, std::vector<PlacedPencil>* pencils) const;

  const AssemblyOptions& options_;
  const std::vector<DetectedLine>& lines_;
  const std::vector<CircleEvidence>& circles_;
};

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_CHOOSE_PLANE_H_
