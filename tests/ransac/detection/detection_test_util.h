// Photographs made to order, for the tests of detection: a pattern on a plane seen through any
// camera, anti-aliased by supersampling, blurred and made noisy; and where real ones may be found.
#ifndef CIRCLINE_TESTS_RANSAC_DETECTION_DETECTION_TEST_UTIL_H_
#define CIRCLINE_TESTS_RANSAC_DETECTION_DETECTION_TEST_UTIL_H_

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>

#include "circline/estimators/basics.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/circle_pose.h"
#include "circline/estimators/conic_fit.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/random.h"
#include "tests/pinhole_camera.h"

namespace circline::detection_test {

inline Camera TestCamera(int width = 480, int height = 360, double focal = 500.0) {
  return CenteredCamera(focal, width, height);
}

inline Camera DistortedCamera() {
  Camera camera = TestCamera();
  camera.model = CameraModel::kOpenCV;
  camera.distortion[0] = -0.45;
  camera.distortion[1] = 0.22;
  return camera;
}

inline Camera FisheyeCamera() {
  Camera camera = TestCamera(480, 360, 200.0);
  camera.model = CameraModel::kFisheye;
  camera.distortion[0] = 0.02;
  camera.distortion[1] = -0.005;
  return camera;
}

// Grey level at a point of the plane Z = 0.
using Pattern = std::function<double(double x, double y)>;
// Grey level at a pixel (non-integer).
using PixelPattern = std::function<double(double u, double v)>;

// Mean of `pattern` over each pixel, at points of an evenly spread sequence: those of a regular
// grid would move a contour in steps of their spacing wherever it runs along an axis or a diagonal.
inline cv::Mat Render(int width, int height, const PixelPattern& pattern) {
  constexpr int kSamples = 49;
  // Roberts' R2 sequence: powers of the inverse plastic number.
  constexpr double kStepU = 0.7548776662466927, kStepV = 0.5698402909980532;
  // A pixel whose four corners agree is not crossed by a contour, but for a sliver.
  cv::Mat corners(height + 1, width + 1, CV_64F);
  for (int y = 0; y <= height; ++y) {
    for (int x = 0; x <= width; ++x) corners.at<double>(y, x) = pattern(x - 0.5, y - 0.5);
  }
  cv::Mat image(height, width, CV_32F);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double corner = corners.at<double>(y, x);
      if (corner == corners.at<double>(y, x + 1) && corner == corners.at<double>(y + 1, x) &&
          corner == corners.at<double>(y + 1, x + 1)) {
        image.at<float>(y, x) = static_cast<float>(corner);
        continue;
      }
      double sum = 0.0;
      for (int k = 0; k < kSamples; ++k) {
        // In pairs on opposite sides of the centre, which is the last: the mean is the centre.
        const int pair = k / 2;
        const double u = std::fmod(pair * kStepU, 1.0) - 0.5;
        const double v = std::fmod(pair * kStepV, 1.0) - 0.5;
        const double sign = k == kSamples - 1 ? 0.0 : k % 2 == 0 ? 1.0 : -1.0;
        sum += pattern(x + sign * u, y + sign * v);
      }
      image.at<float>(y, x) = static_cast<float>(sum / kSamples);
    }
  }
  return image;
}

// To an 8-bit photo: blur (standard deviation, pixels), then Gaussian noise (grey levels).
inline cv::Mat Develop(const cv::Mat& image, double blur = 0.7, double noise = 0.0,
                       std::uint64_t seed = 1) {
  cv::Mat photo;
  if (blur > 0.0) {
    cv::GaussianBlur(image, photo, cv::Size(), blur);
  } else {
    photo = image.clone();
  }
  Random random(seed);
  for (int y = 0; noise > 0.0 && y < photo.rows; ++y) {
    for (int x = 0; x < photo.cols; ++x) {
      photo.at<float>(y, x) += static_cast<float>(noise * random.Normal());
    }
  }
  photo.convertTo(photo, CV_8U);
  return photo;
}

// The plane Z = 0 of `pose` through `camera`; what does not see it is `background`.
inline cv::Mat RenderPlane(const Camera& camera, const CameraPose& pose, double background,
                           const Pattern& pattern) {
  const Eigen::Matrix3d world_from_cam = pose.rotation.transpose();
  const Eigen::Vector3d eye = -world_from_cam * pose.translation;
  return Render(camera.width, camera.height, [&](double u, double v) {
    CalibratedPoint p;
    if (!PixelToCalibrated(camera, Eigen::Vector2d(u, v), &p)) return background;
    const Eigen::Vector3d ray = world_from_cam * p.Homogeneous();
    const double s = -eye.z() / ray.z();
    if (!(s > 0.0)) return background;
    return pattern(eye.x() + s * ray.x(), eye.y() + s * ray.y());
  });
}

// Looks at the origin of Z = 0 from `distance`, tilted about the image's x and y axes and turned.
inline CameraPose LookAt(double tilt_x_deg, double tilt_y_deg, double turn_deg, double distance) {
  CameraPose pose;
  pose.rotation = ExpRotation(Eigen::Vector3d(tilt_x_deg * kDegree, tilt_y_deg * kDegree, 0.0)) *
                  ExpRotation(Eigen::Vector3d(kPi, 0.0, 0.0)) *
                  ExpRotation(Eigen::Vector3d(0.0, 0.0, turn_deg * kDegree));
  pose.translation = Eigen::Vector3d(0.0, 0.0, distance);
  return pose;
}

inline cv::Mat Noise(int width, int height, double sigma, std::uint64_t seed = 1) {
  return Develop(cv::Mat(height, width, CV_32F, cv::Scalar(128.0)), 0.0, sigma, seed);
}

inline double AxisDeg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), std::abs(a.dot(b))) / kDegree;
}

// Of the two normals that a circle's image allows.
inline double BetterNormalDeg(const ConicFit& fit, const Eigen::Vector3d& normal) {
  std::array<CirclePose, 2> poses;
  double best = 180.0;
  for (int k = CirclePoses(fit.conic, &poses) - 1; k >= 0; --k)
    best = std::min(best, AxisDeg(poses[static_cast<std::size_t>(k)].normal, normal));
  return best;
}

// Folder with sets of photographs, from the environment or beside the sources; may not exist.
inline std::string DataFolder() {
  const char* folder = std::getenv("CIRCLINE_DATA");
  if (folder != nullptr) return folder;
#ifdef CIRCLINE_SOURCE_DIR
  return std::string(CIRCLINE_SOURCE_DIR) + "/../shared/data";
#else
  return "../shared/data";
#endif
}

inline bool HasSet(const std::string& name) {
  return std::ifstream(DataFolder() + "/" + name + "/groundtruth.yml").good();
}

// Of a circle of the plane with this normal, of radius 1; each number of its conic has `variance`.
inline ConicFit FitOfCircle(const Eigen::Vector3d& normal, const Eigen::Vector3d& center,
                            double variance) {
  CirclePose pose;
  pose.normal = normal.z() > 0.0 ? Eigen::Vector3d(-normal.normalized()) : normal.normalized();
  pose.center = center;
  ConicFit fit;
  fit.conic = ProjectCircle(pose);
  const Vector6d v = ConicToVector(fit.conic);
  const Matrix6d c = variance * (Matrix6d::Identity() - v * v.transpose());
  for (int i = 0; i < 36; ++i) fit.covariance[static_cast<std::size_t>(i)] = c(i / 6, i % 6);
  return fit;
}

}  // namespace circline::detection_test

#endif  // CIRCLINE_TESTS_RANSAC_DETECTION_DETECTION_TEST_UTIL_H_
