#include "apps/common/scene_values.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <string>

namespace circline::apps {

Eigen::Vector2d ReadPixel(const StorageNode& node) {
  const std::vector<double> v = node.Numbers(2);
  return v.empty() ? Eigen::Vector2d::Zero() : Eigen::Vector2d(v[0], v[1]);
}

std::vector<Eigen::Vector2d> ReadPixels(const StorageNode& node, std::size_t least) {
  const std::vector<double> v = node.Numbers(0, 2);
  std::vector<Eigen::Vector2d> points;
  for (std::size_t i = 0; i + 1 < v.size(); i += 2) points.emplace_back(v[i], v[i + 1]);
  if (points.size() < least) {
    node.Fail("must have " + std::to_string(least) + " points or more, has " +
              std::to_string(points.size()));
  }
  return points;
}

std::vector<Segment> ReadSegments(const StorageNode& node) {
  const std::vector<double> v = node.Numbers(0, 4);
  std::vector<Segment> segments;
  for (std::size_t i = 0; i + 3 < v.size(); i += 4) {
    segments.push_back({Eigen::Vector2d(v[i], v[i + 1]), Eigen::Vector2d(v[i + 2], v[i + 3])});
    if (segments.back()[0] == segments.back()[1]) {
      node.Fail("segment " + std::to_string(i / 4) + " has no length");
    }
  }
  return segments;
}

Segment ReadSegment(const StorageNode& node) {
  const std::vector<double> v = node.Numbers(4);
  if (v.empty()) return {Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};
  return ReadSegments(node).front();
}

double ReadPositive(const StorageNode& node) {
  if (!node.Exists()) return 0.0;
  const double value = node.Number();
  if (!(value > 0.0)) node.Fail("must be positive");
  return value;
}

std::string ReadOptionalText(const StorageNode& node) {
  return node.Exists() ? node.Text() : std::string();
}

std::array<int, 4> ReadRectangle(const StorageNode& node) {
  const std::vector<double> v = node.Numbers(4);
  if (v.empty()) return {};
  if (std::any_of(v.begin(), v.end(), [](double x) { return std::abs(x) > 1e6; })) {
    node.Fail("is not a rectangle of a photo");
    return {};
  }
  const int x0 = static_cast<int>(std::floor(v[0])), y0 = static_cast<int>(std::floor(v[1]));
  const int x1 = static_cast<int>(std::ceil(v[0] + v[2]));
  const int y1 = static_cast<int>(std::ceil(v[1] + v[3]));
  if (!(v[2] > 0.0) || !(v[3] > 0.0)) node.Fail("width and height must be positive");
  return {x0, y0, x1 - x0, y1 - y0};
}

Eigen::Vector3d ReadVector3(const StorageNode& node) {
  const std::vector<double> v = node.Numbers(3);
  return v.empty() ? Eigen::Vector3d::Zero() : Eigen::Vector3d(v[0], v[1], v[2]);
}

Eigen::Matrix3d ReadRotation(const StorageNode& node) {
  const std::vector<double> v = node.Numbers(9);
  if (v.empty()) return Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d given =
      Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(v.data());
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(given, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d rotation = svd.matrixU() * svd.matrixV().transpose();
  if ((rotation - given).norm() > 1e-3 || rotation.determinant() < 0.0) {
    node.Fail("is not a rotation matrix");
  }
  return rotation;
}

}  // namespace circline::apps
