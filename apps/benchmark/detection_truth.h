// What is true of photographs: the groundtruth.yml or truth.csv of a set.
#ifndef CIRCLINE_APPS_BENCHMARK_DETECTION_TRUTH_H_
#define CIRCLINE_APPS_BENCHMARK_DETECTION_TRUTH_H_

#include <Eigen/Core>
#include <map>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/conic.h"

namespace circline::benchmark {

struct RenderedImage {
  int group = 0;
  std::vector<Ellipse> ellipses;
  std::vector<Eigen::Vector3d> normals;
  std::vector<Eigen::Vector2d> centers;  // Of the circle; the two rims of a ring share theirs.
};

// By file name.
std::map<std::string, RenderedImage> ReadRenderings(const std::string& path);

// An empty matrix or text where there is no such key.
cv::Mat ReadMatrix(const cv::FileNode& node, const char* key);
std::string ReadText(const cv::FileNode& node, const char* key);

// Of an image of a set; false where it is not calibrated.
bool CameraOf(const cv::FileNode& root, const cv::FileNode& image, const cv::Size& size,
              Camera* camera);

Eigen::Matrix3d ToEigen(const cv::Mat& m);
Eigen::Vector3d ToVector(const cv::Mat& m);

// Centre, semi-axes, angle in degrees.
Ellipse ReadEllipse(const cv::Mat& m);

}  // namespace circline::benchmark

#endif  // CIRCLINE_APPS_BENCHMARK_DETECTION_TRUTH_H_
