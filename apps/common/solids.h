// What a photo shows of solid things, as a person or a program has marked it.
#ifndef CIRCLINE_APPS_COMMON_SOLIDS_H_
#define CIRCLINE_APPS_COMMON_SOLIDS_H_

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

namespace circline::apps {

// One of a box's edges. The box's origin is a corner, its axes run along the edges there.
struct BoxEdge {
  int axis = 0;                         // Along which it runs: 0, 1, 2.
  std::array<bool, 3> far{};            // Whether it lies at the far end along the other two.
  std::vector<Eigen::Vector2d> points;  // Pixels, 2 or more.
  double sigma_px = 0.0;                // Standard deviation of each coordinate; 0 = not known.
  double shared_px = 0.0;               // Of what all points have in common, beside it.
};

struct BoxObservation {
  std::string id;
  std::vector<BoxEdge> edges;      // Empty: to be found in the photo.
  std::array<double, 3> length{};  // Along x, y, z, where known; 0 = not known.
  double length_sigma = 0.0;       // Of these, relative; 0 = that of the noise model.
  std::array<double, 3> truth{};   // Along x, y, z, to measure errors by; 0 = not known.
};

// A round box or a cup on the world's plane: two rims, or one and the image of the other's centre.
struct CylinderObservation {
  std::string id;
  std::string base, rim;  // Ids of circles: on the world's plane, and above; `rim` may be empty.
  std::optional<Eigen::Vector2d> top;  // Image of the upper rim's centre, pixels, without `rim`.
  double true_height = 0.0;            // To measure errors by; 0 = not known.
};

// A piece of a plane.
struct FaceObservation {
  std::string id, plane;                 // `plane`: empty = the world's.
  std::vector<Eigen::Vector2d> corners;  // Pixels, in order, 3 or more.
};

struct Solids {
  std::vector<FaceObservation> faces;
  std::vector<BoxObservation> boxes;
  std::vector<CylinderObservation> cylinders;

  bool empty() const { return faces.empty() && boxes.empty() && cylinders.empty(); }
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_SOLIDS_H_
