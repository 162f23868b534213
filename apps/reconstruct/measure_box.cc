#include "apps/reconstruct/measure_box.h"

#include <Eigen/Dense>
#include <cmath>
#include <string>

#include "circline/estimators/basics.h"

namespace circline::apps {
namespace {

// Between the normal of the circle alone and the nearest axis of the box alone. The standard
// deviation is that of both together about the axis that turns one into the other.
bool Agreement(const CircleObservation& circle, const BoxFit& fit, const Observations& observations,
               const EstimationOptions& options, MeasuredValue* agreement) {
  Observations alone;
  alone.camera = observations.camera;
  alone.stated_focal_px = observations.stated_focal_px;
  alone.found_k1 = observations.found_k1;
  alone.circles = {circle};
  const PoseEstimate estimate = EstimatePose(alone, options);
  double nearest = -1.0;
  for (const PoseHypothesis& hypothesis : estimate.hypotheses) {
    const Eigen::Vector3d normal = hypothesis.cam_from_world.rotation.col(2);
    for (int k = 0; k < 3; ++k) {
      Eigen::Vector3d axis = fit.cam_from_box.rotation.col(k);
      if (axis.dot(normal) < 0.0) axis = -axis;
      const Eigen::Vector3d turn = normal.cross(axis);
      if (axis.dot(normal) <= nearest || !(turn.norm() > 0.0)) continue;
      nearest = axis.dot(normal);
      const Eigen::Vector3d about = turn.normalized();
      const double variance = about.dot(
          (hypothesis.Covariance().topLeftCorner<3, 3>() + fit.covariance.topLeftCorner<3, 3>()) *
          about);
      *agreement = {"agreement",
                    circle.id + " " + "xyz"[k],
                    std::atan2(turn.norm(), nearest) / kDegree,
                    std::sqrt(variance) / kDegree,
                    "deg",
                    0.0};
    }
  }
  return nearest >= 0.0;
}

}  // namespace

std::vector<MeasuredValue> MeasureBox(const BoxFit& fit, const BoxObservation& box,
                                      const Observations& observations,
                                      const EstimationOptions& options) {
  const std::string unit = fit.metric ? "world" : "distance";
  std::vector<MeasuredValue> all;
  const Eigen::Vector3d& t = fit.cam_from_box.translation;
  if (fit.metric) {
    const Eigen::Vector3d ray = t.normalized();
    all.push_back({"distance", "camera", t.norm(),
                   std::sqrt(ray.dot(fit.covariance.block<3, 3>(3, 3) * ray)), unit, 0.0});
  }
  for (int k = 0; k < 3; ++k) {
    all.push_back({"length", box.id + " " + "xyz"[k], fit.length[k],
                   std::sqrt(fit.covariance(6 + k, 6 + k)), unit,
                   fit.metric ? box.truth[static_cast<std::size_t>(k)] : 0.0});
  }
  for (int a = 0; a < 3; ++a) {
    const int b = (a + 1) % 3;
    const auto i = static_cast<std::size_t>(a), j = static_cast<std::size_t>(b);
    const double ratio = fit.length[a] / fit.length[b];
    Eigen::Matrix<double, 9, 1> by = Eigen::Matrix<double, 9, 1>::Zero();
    by[6 + a] = 1.0 / fit.length[b];
    by[6 + b] = -ratio / fit.length[b];
    const bool known = box.truth[i] > 0.0 && box.truth[j] > 0.0;
    all.push_back({"ratio", box.id + " " + "xyz"[a] + "/" + "xyz"[b], ratio,
                   std::sqrt(by.dot(fit.covariance * by)), "",
                   known ? box.truth[i] / box.truth[j] : 0.0});
  }
  for (const CircleObservation& circle : observations.circles) {
    MeasuredValue agreement;
    if (Agreement(circle, fit, observations, options, &agreement)) all.push_back(agreement);
  }
  return all;
}

}  // namespace circline::apps
