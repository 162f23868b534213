// What circline_robust_fit_benchmark and the tests fit: seeded contours, lines and segments among
// clutter, seen by PinholeCamera(), with what is true of them.
#ifndef CIRCLINE_APPS_BENCHMARK_ROBUST_FIT_SCENES_H_
#define CIRCLINE_APPS_BENCHMARK_ROBUST_FIT_SCENES_H_

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/conic.h"
#include "circline/estimators/line.h"
#include "circline/ransac/conic_model.h"

namespace circline::apps {

enum class Clutter {
  kUniform,  // In 1.5 times the bounding box of the whole ellipse.
  kArcBox,   // In 1.5 times the bounding box of the arc that is seen.
  kEllipse,  // A second ellipse of semi-axes 80 and 50 px that shares the box, with the same noise.
  kEdge,     // A straight edge of 300 px that crosses the contour, with the same noise.
  kCluster,  // A disc of 15 px radius somewhere in the box.
  kRim,      // An arc of a second rim, 1.15 times as large and as dense, with the same noise.
};

// Points of an ellipse of semi-axes 100 and 60 px, evenly spread (in the eccentric anomaly)
// over an arc, with Gaussian noise on both coordinates; then the clutter.
struct ConicScene {
  std::vector<Eigen::Vector2d> pixels;  // The contour's first, then the clutter.
  std::vector<CalibratedPoint> points;  // The same.
  EdgeDirections directions;            // Normals with noise; any where the clutter has none.
  std::vector<CalibratedPoint> truth;   // The contour without noise.
  std::vector<CalibratedPoint> rim;     // The second rim, as far as it is seen, without noise.
  double sigma_px = 1.0;

  // RMS error along the true contour, or the second rim, in units of the Cramer-Rao bound (5
  // parameters).
  double Error(const Eigen::Matrix3d& conic) const;
  double RimError(const Eigen::Matrix3d& conic) const;
};

struct ConicSceneOptions {
  int num_inliers = 100;
  double outlier_ratio = 0.5;  // Of all points.
  double arc_deg = 360.0;
  Clutter clutter = Clutter::kUniform;
  double sigma_px = 1.0;
  double direction_sigma_rad = EdgeDirections().sigma_rad;
};

ConicScene MakeConicScene(const ConicSceneOptions& options, std::uint64_t seed);

// 100 points along 300 px with Gaussian noise, outliers uniform in 400 x 400 px.
struct LineScene {
  std::vector<Eigen::Vector2d> pixels;
  std::vector<CalibratedPoint> points, truth;
  double sigma_px = 1.0;

  // As above (2 parameters).
  double Error(const Eigen::Vector3d& line) const;
};

LineScene MakeLineScene(double outlier_ratio, double sigma_px, std::uint64_t seed);

// Segments of 20 to 120 px, end points with sigma 0.5 px: `per_direction` of each column of a
// random rotation, in order, then clutter of any direction.
struct PencilScene {
  Eigen::Matrix3d rotation;
  std::vector<LineFit> lines;
  int per_direction = 0;
  // Cramer-Rao bound of the rotation when it is known which segment belongs to which direction:
  // root mean square of the whole angle, radians.
  double rotation_bound = 0.0;

  // Angle of the rotation between the truth and `estimate`, whose columns are taken in the order
  // and with the signs that fit best, radians.
  double Error(const Eigen::Matrix3d& estimate) const;
};

PencilScene MakePencilScene(int per_direction, double clutter_ratio, std::uint64_t seed);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_BENCHMARK_ROBUST_FIT_SCENES_H_
