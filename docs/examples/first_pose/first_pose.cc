// The poses that a photo admits: first_pose PHOTO FOCAL_PX
#include <cstdio>
#include <cstdlib>
#include <opencv2/imgcodecs.hpp>

#include "circline/ransac/detection/detect_observations.h"
#include "circline/refine/estimate_pose.h"

int main(int argc, char** argv) {
  if (argc != 3) return 2;
  const cv::Mat photo = cv::imread(argv[1]);
  circline::Camera camera;  // A pinhole; Camera::distortion is for lenses.
  camera.width = photo.cols;
  camera.height = photo.rows;
  camera.fx = camera.fy = std::atof(argv[2]);
  camera.cx = 0.5 * (photo.cols - 1);
  camera.cy = 0.5 * (photo.rows - 1);

  circline::Observations observations;
  const circline::Status detected =
      circline::DetectObservations(photo, camera, circline::DetectionOptions(), &observations);
  const circline::PoseEstimate estimate = circline::EstimatePose(observations);
  if (!detected.ok() || !estimate.status.ok()) {
    std::fprintf(stderr, "%s %s\n", detected.message.c_str(), estimate.status.message.c_str());
    return 1;
  }
  for (const circline::PoseHypothesis& pose : estimate.hypotheses) {
    const Eigen::Vector3d normal = pose.cam_from_world.rotation.col(2);
    std::printf("probability %.2f, the plane's normal %.3f %.3f %.3f\n", pose.probability,
                normal.x(), normal.y(), normal.z());
  }
  return 0;
}
