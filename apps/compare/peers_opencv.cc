// OpenCV's solvePnP.
#include "apps/compare/peers.h"

#ifdef CIRCLINE_WITH_CALIB3D
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#endif

namespace circline::apps {

#ifdef CIRCLINE_WITH_CALIB3D
namespace {

// On undistorted points, for solvePnP knows no fisheye lens: the camera is then the identity.
template <int method>
PoseEstimate SolvePnp(const SceneImage& image, const Observations& observations) {
  PoseEstimate estimate;
  PeerPoints points;
  estimate.status = UsablePoints(image, observations.camera, &points);
  if (!estimate.status.ok()) return estimate;
  std::vector<cv::Point2d> seen;
  std::vector<cv::Point3d> world;
  for (std::size_t i = 0; i < points.world.size(); ++i) {
    seen.emplace_back(points.calibrated[i].x(), points.calibrated[i].y());
    world.emplace_back(points.world[i].x(), points.world[i].y(), points.world[i].z());
  }
  std::vector<cv::Mat> rvecs, tvecs;
  cv::solvePnPGeneric(world, seen, cv::Matx33d::eye(), cv::noArray(), rvecs, tvecs, false,
                      static_cast<cv::SolvePnPMethod>(method));
  for (std::size_t i = 0; i < rvecs.size(); ++i) {
    cv::Matx33d rotation;
    cv::Rodrigues(rvecs[i], rotation);
    CameraPose pose;
    cv::cv2eigen(rotation, pose.rotation);
    cv::cv2eigen(tvecs[i], pose.translation);
    estimate.hypotheses.push_back(PointsHypothesis(pose, image, observations.camera));
  }
  SortByResidual(&estimate);
  return estimate;
}

}  // namespace

void AddOpenCvPeers(std::vector<PeerSolver>* peers) {
  const auto add = [peers](const char* name, SolverStage stage, const char* needs,
                           PeerSolver::Function function) {
    peers->push_back({name, stage, needs, function});
  };
  add("opencv_ippe", SolverStage::kClosedForm, "4 or more known points of a plane",
      SolvePnp<cv::SOLVEPNP_IPPE>);
  add("opencv_sqpnp", SolverStage::kClosedForm, "4 or more known points",
      SolvePnp<cv::SOLVEPNP_SQPNP>);
  add("opencv_iterative", SolverStage::kRefined, "4 or more known points",
      SolvePnp<cv::SOLVEPNP_ITERATIVE>);
}

#else
void AddOpenCvPeers(std::vector<PeerSolver>* /*peers*/) {}
#endif

}  // namespace circline::apps
