// What all frames so far can tell at best: the posterior Cramer-Rao bound of a tracker, as the
// covariance of a Kalman filter that is linearised at the truth (Tichavsky, Muravchik and Nehorai
// 1998). Derivatives of what is measured are differences.
#ifndef CIRCLINE_APPS_BENCHMARK_TRACKING_BOUND_H_
#define CIRCLINE_APPS_BENCHMARK_TRACKING_BOUND_H_

#include <Eigen/Core>
#include <cstddef>

#include "apps/benchmark/trajectory.h"
#include "circline/refine/pose_tracker.h"
#include "circline/refine/track/track_state.h"

namespace circline::apps {

class TrackingBound {
 public:
  TrackingBound(const Trajectory& sequence, const TrackerOptions& options);
  // Takes in frame k, one after the other; the standard deviation of the plane's normal, radians,
  // both components together.
  double Advance(std::size_t k);

 private:
  void SetTruth(const Trajectory::Frame& frame);
  Eigen::MatrixXd Information(const Trajectory::Frame& frame) const;

  const Trajectory& sequence_;
  TrackerOptions options_;
  TrackMap map_;
  TrackState state_;
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_BENCHMARK_TRACKING_BOUND_H_
