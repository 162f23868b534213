#include "apps/compare/peers.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>

namespace circline::apps {
namespace {

constexpr std::size_t kFewestPoints = 4;

// Of the points that a solver is given. Infinite if the pose has one where the camera does not see
// it, behind itself above all.
double RmsPx(const CameraPose& pose, const SceneImage& image, const Camera& camera, int* count) {
  double sum = 0.0;
  *count = 0;
  for (const KnownPoint& point : image.points) {
    CalibratedPoint ray;
    if (!PixelToCalibrated(camera, point.pixel, &ray)) continue;
    Eigen::Vector2d pixel;
    const Eigen::Vector3d seen = pose.rotation * point.world + pose.translation;
    if (!CameraToPixel(camera, seen, &pixel)) return std::numeric_limits<double>::infinity();
    sum += (pixel - point.pixel).squaredNorm();
    *count += 2;
  }
  return std::sqrt(sum / std::max(1, *count));
}

}  // namespace

PoseEstimate PeerSolver::Solve(const SceneImage& image, const Observations& observations) const {
  PoseEstimate estimate;
  try {
    estimate = function(image, observations);
  } catch (const std::exception& error) {
    estimate.hypotheses.clear();
    estimate.status = Status::Failed(std::string("it says: ") + error.what());
    std::replace(estimate.status.message.begin(), estimate.status.message.end(), '\n', ' ');
  }
  estimate.solver = name;
  if (estimate.hypotheses.empty() && estimate.status.ok()) {
    estimate.status = Status::Failed("it found no pose");
  }
  return estimate;
}

std::vector<PeerSolver> PeerSolvers() {
  std::vector<PeerSolver> peers;
  AddOpenCvPeers(&peers);
  AddOpenGvPeers(&peers);
  AddVispPeers(&peers);
  return peers;
}

Status UsablePoints(const SceneImage& image, const Camera& camera, PeerPoints* points) {
  for (const KnownPoint& point : image.points) {
    CalibratedPoint ray;
    if (!PixelToCalibrated(camera, point.pixel, &ray)) continue;
    points->calibrated.push_back(ray.x);
    points->world.push_back(point.world);
  }
  if (points->world.size() >= kFewestPoints) return Status::Ok();
  return Status::Refused("the scene file gives " + std::to_string(points->world.size()) +
                         " points of this photo; 4 or more are needed");
}

void SortByResidual(PoseEstimate* estimate) {
  std::stable_sort(
      estimate->hypotheses.begin(), estimate->hypotheses.end(),
      [](const PoseHypothesis& a, const PoseHypothesis& b) { return a.rms_px < b.rms_px; });
}

PoseHypothesis PeerHypothesis(const CameraPose& pose) {
  PoseHypothesis hypothesis;
  hypothesis.cam_from_world = pose;
  hypothesis.metric = hypothesis.origin_observed = true;
  hypothesis.probability = std::numeric_limits<double>::quiet_NaN();
  hypothesis.rms_px = std::numeric_limits<double>::quiet_NaN();
  hypothesis.covariance.fill(0.0);
  for (std::size_t i = 0; i < 6; ++i) {
    hypothesis.covariance[7 * i] = std::numeric_limits<double>::infinity();
  }
  return hypothesis;
}

PoseHypothesis PointsHypothesis(const CameraPose& pose, const SceneImage& image,
                                const Camera& camera) {
  PoseHypothesis hypothesis = PeerHypothesis(pose);
  int count = 0;
  hypothesis.rms_px = RmsPx(pose, image, camera, &count);
  hypothesis.num_inliers = hypothesis.num_observations = count;
  return hypothesis;
}

}  // namespace circline::apps
