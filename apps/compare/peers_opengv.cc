// OpenGV: poses of known points.
#include "apps/compare/peers.h"

#ifdef CIRCLINE_WITH_OPENGV
#include <cmath>
#include <opengv/absolute_pose/CentralAbsoluteAdapter.hpp>
#include <opengv/absolute_pose/methods.hpp>
#include <utility>
#endif

namespace circline::apps {

#ifdef CIRCLINE_WITH_OPENGV
namespace {

using opengv::transformation_t;
using opengv::absolute_pose::CentralAbsoluteAdapter;

// Its poses are those of the camera in the world.
CameraPose FromOpenGv(const transformation_t& world_from_cam) {
  CameraPose pose;
  pose.rotation = world_from_cam.leftCols<3>().transpose();
  pose.translation = -pose.rotation * world_from_cam.col(3);
  return pose;
}

enum class Method { kP3p, kUpnp, kNonlinear };

template <Method method>
PoseEstimate SolvePoints(const SceneImage& image, const Observations& observations) {
  PoseEstimate estimate;
  PeerPoints points;
  estimate.status = UsablePoints(image, observations.camera, &points);
  if (!estimate.status.ok()) return estimate;
  opengv::bearingVectors_t rays;
  const opengv::points_t world(points.world.begin(), points.world.end());
  for (const Eigen::Vector2d& point : points.calibrated) {
    rays.push_back(point.homogeneous().normalized());
  }
  CentralAbsoluteAdapter adapter(rays, world);
  const auto found = method == Method::kP3p ? opengv::absolute_pose::p3p_kneip(adapter)
                                            : opengv::absolute_pose::upnp(adapter);
  for (const transformation_t& pose : found) {
    PoseHypothesis hypothesis = PointsHypothesis(FromOpenGv(pose), image, observations.camera);
    // Some of its poses have the points behind the camera.
    if (std::isfinite(hypothesis.rms_px)) estimate.hypotheses.push_back(std::move(hypothesis));
  }
  SortByResidual(&estimate);
  if (method != Method::kNonlinear || estimate.hypotheses.empty()) return estimate;
  const CameraPose& start = estimate.hypotheses.front().cam_from_world;
  adapter.setR(start.rotation.transpose());
  adapter.sett(-start.rotation.transpose() * start.translation);
  const transformation_t best = opengv::absolute_pose::optimize_nonlinear(adapter);
  estimate.hypotheses = {PointsHypothesis(FromOpenGv(best), image, observations.camera)};
  return estimate;
}

}  // namespace

void AddOpenGvPeers(std::vector<PeerSolver>* peers) {
  const char* needs = "4 or more known points";
  peers->push_back({"opengv_p3p", SolverStage::kClosedForm, needs, SolvePoints<Method::kP3p>});
  peers->push_back({"opengv_upnp", SolverStage::kClosedForm, needs, SolvePoints<Method::kUpnp>});
  peers->push_back({"opengv_upnp", SolverStage::kRefined, needs, SolvePoints<Method::kNonlinear>});
}

#else
void AddOpenGvPeers(std::vector<PeerSolver>* /*peers*/) {}
#endif

}  // namespace circline::apps
