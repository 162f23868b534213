// What the points of a scene can tell at best: the Cramer-Rao bound.
#ifndef CIRCLINE_APPS_BENCHMARK_SCENES_BOUND_H_
#define CIRCLINE_APPS_BENCHMARK_SCENES_BOUND_H_

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "apps/benchmark/scenes_world.h"

namespace circline::apps {

// Which evidence counts, and what besides pose and structure is unknown.
struct BoundRequest {
  double noise_px = 1.0;
  std::vector<std::uint8_t> circles;  // 1: used; empty: all. Odd lines never count.
  double log_focal_sigma = 0.0;       // Prior of log f; 0: known.
};

// Structure (centres, radii, lines, free directions) is unknown, and eliminated.
struct Bound {
  bool finite = false;
  bool rotation_is_free = false;
  // Of delta, camera frame, rotation = exp([delta]x) truth, radians^2; where the rotation about the
  // normal is free, of its components across the normal alone.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  double rotation_rad = 0.0;  // Root of its trace.
  double log_focal = 0.0;     // Standard deviations.
  double log_distance = 0.0;  // Of the plane; of a scene with a stated radius.
};

Bound ComputeBound(const World& world, const BoundRequest& request);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_BENCHMARK_SCENES_BOUND_H_
