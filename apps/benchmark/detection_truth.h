// What is true of photographs: the groundtruth.yml of a set.
#ifndef CIRCLINE_APPS_BENCHMARK_DETECTION_TRUTH_H_
#define CIRCLINE_APPS_BENCHMARK_DETECTION_TRUTH_H_

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <string>

#include "circline/estimators/camera.h"
#include "circline/estimators/conic.h"

namespace circline::apps {

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

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_BENCHMARK_DETECTION_TRUTH_H_
