#include "apps/compare/peers.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>

#ifdef CIRCLINE_WITH_PEERS
#include <opencv2/calib3d.hpp>
#endif

namespace circline::apps {

#ifdef CIRCLINE_WITH_PEERS
namespace {

constexpr std::size_t kFewestPoints = 4;

// OpenCV's camera. It has no fisheye model in solvePnP: there the points are undistorted first.
struct CvView {
  cv::Matx33d matrix;
  std::vector<double> distortion;
  std::vector<cv::Point2d> pixels;
  std::vector<cv::Point3d> world;
};

CvView MakeView(const SceneImage& image) {
  const Camera& camera = image.observations.camera;
  CvView view;
  view.matrix = {camera.fx, 0.0, camera.cx, 0.0, camera.fy, camera.cy, 0.0, 0.0, 1.0};
  const bool fisheye = camera.model == CameraModel::kFisheye;
  if (!fisheye) view.distortion.assign(camera.distortion.begin(), camera.distortion.end());
  for (const KnownPoint& point : image.points) {
    Eigen::Vector2d pixel = point.pixel;
    CalibratedPoint ray;
    if (fisheye && !PixelToCalibrated(camera, pixel, &ray)) continue;
    if (fisheye) pixel = {camera.fx * ray.x.x() + camera.cx, camera.fy * ray.x.y() + camera.cy};
    view.pixels.emplace_back(pixel.x(), pixel.y());
    view.world.emplace_back(point.world.x(), point.world.y(), point.world.z());
  }
  return view;
}

double RmsPx(const CameraPose& pose, const SceneImage& image) {
  double sum = 0.0;
  int count = 0;
  for (const KnownPoint& point : image.points) {
    Eigen::Vector2d pixel;
    const Eigen::Vector3d seen = pose.rotation * point.world + pose.translation;
    if (!CameraToPixel(image.observations.camera, seen, &pixel)) continue;
    sum += (pixel - point.pixel).squaredNorm();
    count += 2;
  }
  return std::sqrt(sum / std::max(1, count));
}

PoseHypothesis MakeHypothesis(const cv::Mat& rvec, const cv::Mat& tvec, const SceneImage& image) {
  cv::Matx33d rotation;
  cv::Rodrigues(rvec, rotation);
  PoseHypothesis hypothesis;
  for (int i = 0; i < 9; ++i) hypothesis.cam_from_world.rotation(i / 3, i % 3) = rotation.val[i];
  for (int i = 0; i < 3; ++i) hypothesis.cam_from_world.translation[i] = tvec.at<double>(i);
  hypothesis.metric = hypothesis.origin_observed = true;
  hypothesis.probability = std::numeric_limits<double>::quiet_NaN();
  hypothesis.covariance.fill(0.0);
  for (std::size_t i = 0; i < 6; ++i) {
    hypothesis.covariance[7 * i] = std::numeric_limits<double>::infinity();
  }
  hypothesis.rms_px = RmsPx(hypothesis.cam_from_world, image);
  hypothesis.num_inliers = hypothesis.num_observations = 2 * static_cast<int>(image.points.size());
  return hypothesis;
}

}  // namespace

PoseEstimate PeerSolver::Solve(const SceneImage& image) const {
  PoseEstimate estimate;
  estimate.solver = name;
  const CvView view = MakeView(image);
  if (view.pixels.size() < kFewestPoints) {
    estimate.status = Status::Refused("the scene file gives " + std::to_string(view.pixels.size()) +
                                      " points of this photo; 4 or more are needed");
    return estimate;
  }
  std::vector<cv::Mat> rvecs, tvecs;
  try {
    cv::solvePnPGeneric(view.world, view.pixels, view.matrix, view.distortion, rvecs, tvecs, false,
                        static_cast<cv::SolvePnPMethod>(method));
  } catch (const cv::Exception& error) {
    rvecs.clear();
    estimate.status = Status::Failed("OpenCV: " + error.err);
  }
  for (std::size_t i = 0; i < rvecs.size(); ++i) {
    estimate.hypotheses.push_back(MakeHypothesis(rvecs[i], tvecs[i], image));
  }
  std::stable_sort(
      estimate.hypotheses.begin(), estimate.hypotheses.end(),
      [](const PoseHypothesis& a, const PoseHypothesis& b) { return a.rms_px < b.rms_px; });
  if (estimate.hypotheses.empty() && estimate.status.ok()) {
    estimate.status = Status::Failed("OpenCV found no pose");
  }
  return estimate;
}

std::vector<PeerSolver> PeerSolvers() {
  return {{"opencv_ippe", SolverStage::kClosedForm, cv::SOLVEPNP_IPPE},
          {"opencv_sqpnp", SolverStage::kClosedForm, cv::SOLVEPNP_SQPNP},
          {"opencv_iterative", SolverStage::kRefined, cv::SOLVEPNP_ITERATIVE}};
}

#else

PoseEstimate PeerSolver::Solve(const SceneImage& /*image*/) const { return {}; }
std::vector<PeerSolver> PeerSolvers() { return {}; }

#endif

}  // namespace circline::apps
