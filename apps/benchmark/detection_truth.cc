#include "apps/benchmark/detection_truth.h"

#include <algorithm>

#include "circline/estimators/basics.h"

namespace circline::apps {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

bool ReadCamera(const cv::FileNode& node, const cv::Size& size, Camera* camera) {
  const cv::Mat k = ReadMatrix(node, "camera_matrix");
  if (k.empty()) return false;
  camera->width = size.width;
  camera->height = size.height;
  camera->fx = k.at<double>(0, 0);
  camera->fy = k.at<double>(1, 1);
  camera->cx = k.at<double>(0, 2);
  camera->cy = k.at<double>(1, 2);
  cv::Mat d = ReadMatrix(node, "distortion_coefficients");
  camera->distortion.fill(0.0);
  camera->model = CameraModel::kPinhole;
  for (int i = 0; i < std::min(8, static_cast<int>(d.total())); ++i) {
    camera->distortion[static_cast<std::size_t>(i)] = d.at<double>(i);
    if (d.at<double>(i) != 0.0) camera->model = CameraModel::kOpenCV;
  }
  return true;
}

}  // namespace

cv::Mat ReadMatrix(const cv::FileNode& node, const char* key) {
  cv::Mat m;
  if (!node[key].empty()) node[key] >> m;
  return m;
}

std::string ReadText(const cv::FileNode& node, const char* key) {
  return node[key].empty() ? std::string() : static_cast<std::string>(node[key]);
}

bool CameraOf(const cv::FileNode& root, const cv::FileNode& image, const cv::Size& size,
              Camera* camera) {
  if (root["cameras"].empty()) return ReadCamera(root, size, camera);
  for (const cv::FileNode& node : root["cameras"]) {
    if (ReadText(node, "name") == ReadText(image, "camera")) return ReadCamera(node, size, camera);
  }
  return false;
}

Matrix3d ToEigen(const cv::Mat& m) {
  Matrix3d r;
  for (int i = 0; i < 9; ++i) r(i / 3, i % 3) = m.at<double>(i / 3, i % 3);
  return r;
}

Vector3d ToVector(const cv::Mat& m) { return {m.at<double>(0), m.at<double>(1), m.at<double>(2)}; }

Ellipse ReadEllipse(const cv::Mat& m) {
  Ellipse ellipse;
  ellipse.center = {m.at<double>(0), m.at<double>(1)};
  ellipse.a = m.at<double>(2);
  ellipse.b = m.at<double>(3);
  ellipse.angle = m.at<double>(4) * kDegree;
  return ellipse;
}

}  // namespace circline::apps
