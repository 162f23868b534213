#include "apps/reconstruct/patch.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>

#include "circline/estimators/basics.h"

namespace circline::apps {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr unsigned kDiscCorners = 64;
constexpr unsigned kMantleSteps = 48;
constexpr int kMaxTexturePx = 8192;
constexpr double kNear = 1e-6;  // Of the way to a point: what touches it does not hide it.

// Where the ray meets the patch's plane, as share of the way, and (s, t) there.
bool MeetsPlane(const Patch& patch, const Vector3d& eye, const Vector3d& way, double* share,
                double* s, double* t) {
  Eigen::Matrix3d m;
  m << patch.u, patch.v, -way;
  const double volume = m.determinant();
  if (!(std::abs(volume) > 1e-12 * patch.u.norm() * patch.v.norm() * way.norm())) return false;
  const Vector3d x = m.inverse() * (eye - patch.corner);
  *s = x[0];
  *t = x[1];
  *share = x[2];
  return true;
}

bool HidesByMantle(const Patch& patch, const Vector3d& eye, const Vector3d& way) {
  const Vector3d axis = patch.v.normalized();
  const auto across = [&](const Vector3d& x) { return (x - axis * axis.dot(x)).eval(); };
  const Vector3d o = across(eye - patch.corner), d = across(way);
  const double a = d.squaredNorm(), b = o.dot(d), c = o.squaredNorm() - patch.u.squaredNorm();
  const double root = b * b - a * c;
  if (!(root > 0.0) || !(a > 0.0)) return false;
  const double share = (-b - std::sqrt(root)) / a;  // The outside is what hides.
  if (!(share > 0.0 && share < 1.0 - 1e-3)) return false;
  const Vector3d at = eye + share * way - patch.corner;
  const double t = axis.dot(at) / patch.v.norm();
  return t > 0.0 && t < 1.0;
}

// Outwards; of the length of the patch's area, for flat ones.
Vector3d Normal(const Patch& patch, double s) {
  if (patch.shape != PatchShape::kMantle) return patch.u.cross(patch.v);
  return std::cos(s * patch.angle) * patch.u + std::sin(s * patch.angle) * patch.w;
}

struct PatchView {
  const Camera& camera;
  const CameraPose& pose;

  bool Pixel(const Vector3d& point, Vector2d* pixel) const {
    return CameraToPixel(camera, pose.rotation * point + pose.translation, pixel);
  }
};

// Of the texture, so that no pixel of the photo is lost between two of it.
cv::Size TextureSize(const PatchView& view, const Patch& patch, int longest_px) {
  constexpr int kSteps = 8;
  double widest = 0.0, highest = 0.0;
  for (int i = 0; i <= kSteps; ++i) {
    double along_s = 0.0, along_t = 0.0;
    for (int j = 0; j < kSteps; ++j) {
      const double fixed = static_cast<double>(i) / kSteps, from = static_cast<double>(j) / kSteps,
                   to = static_cast<double>(j + 1) / kSteps;
      Vector2d a, b;
      if (view.Pixel(patch.At(from, fixed), &a) && view.Pixel(patch.At(to, fixed), &b))
        along_s += (b - a).norm();
      if (view.Pixel(patch.At(fixed, from), &a) && view.Pixel(patch.At(fixed, to), &b))
        along_t += (b - a).norm();
    }
    widest = std::max(widest, along_s);
    highest = std::max(highest, along_t);
  }
  if (longest_px > 0) {
    const double scale = longest_px / std::max(patch.u.norm(), patch.v.norm());
    widest = scale * patch.u.norm();
    highest = scale * patch.v.norm();
  }
  const auto pixels = [](double size) {
    return std::clamp(static_cast<int>(std::lround(std::min(size, 1.0 * kMaxTexturePx))), 2,
                      kMaxTexturePx);
  };
  return {pixels(widest), pixels(highest)};
}

}  // namespace

Vector3d Patch::At(double s, double t) const {
  if (shape != PatchShape::kMantle) return corner + s * u + t * v;
  return corner + std::cos(s * angle) * u + std::sin(s * angle) * w + t * v;
}

Mesh MeshOf(const Patch& patch) {
  Mesh mesh;
  const auto add = [&](double s, double t) {
    mesh.points.push_back(patch.At(s, t));
    mesh.texture.emplace_back(s, t);
  };
  if (patch.shape == PatchShape::kDisc) {
    mesh.faces.resize(1);
    for (unsigned i = 0; i < kDiscCorners; ++i) {
      const double angle = 2.0 * kPi * i / kDiscCorners;
      add(0.5 + 0.5 * std::cos(angle), 0.5 + 0.5 * std::sin(angle));
      mesh.faces.front().push_back(i);
    }
    return mesh;
  }
  if (patch.shape == PatchShape::kParallelogram) {
    for (const auto& [s, t] : {std::pair(0, 0), std::pair(1, 0), std::pair(1, 1), std::pair(0, 1)})
      add(s, t);
    mesh.faces = {{0, 1, 2, 3}};
    return mesh;
  }
  for (unsigned i = 0; i <= kMantleSteps; ++i) {
    add(static_cast<double>(i) / kMantleSteps, 0.0);
    add(static_cast<double>(i) / kMantleSteps, 1.0);
    if (i > 0) mesh.faces.push_back({2 * i - 2, 2 * i, 2 * i + 1, 2 * i - 1});
  }
  return mesh;
}

std::vector<std::array<unsigned, 3>> Triangles(const Mesh& mesh) {
  std::vector<std::array<unsigned, 3>> triangles;
  for (const std::vector<unsigned>& face : mesh.faces) {
    for (std::size_t i = 2; i < face.size(); ++i)
      triangles.push_back({face[0], face[i - 1], face[i]});
  }
  return triangles;
}

bool Hides(const Patch& patch, const Vector3d& eye, const Vector3d& point) {
  const Vector3d way = point - eye;
  if (patch.shape == PatchShape::kMantle) return HidesByMantle(patch, eye, way);
  double share, s, t;
  if (!MeetsPlane(patch, eye, way, &share, &s, &t)) return false;
  if (!(share > 0.0 && share < 1.0 - kNear)) return false;
  if (patch.shape == PatchShape::kDisc) return std::hypot(s - 0.5, t - 0.5) < 0.5;
  return s > 0.0 && s < 1.0 && t > 0.0 && t < 1.0;
}

cv::Mat PatchTexture(const cv::Mat& photo, const Camera& camera, const CameraPose& pose,
                     const Patch& patch, const std::vector<Patch>& others, int longest_px) {
  const PatchView view{camera, pose};
  const Vector3d eye = -(pose.rotation.transpose() * pose.translation);
  cv::Mat map(TextureSize(view, patch, longest_px), CV_32FC2);
  cv::Mat alpha(map.size(), CV_8U, cv::Scalar(0));
  for (int row = 0; row < map.rows; ++row) {
    for (int column = 0; column < map.cols; ++column) {
      const double s = (column + 0.5) / map.cols, t = 1.0 - (row + 0.5) / map.rows;
      const Vector3d point = patch.At(s, t);
      Vector2d pixel(-1.0, -1.0);
      bool seen = Normal(patch, s).dot(eye - point) > 0.0 && view.Pixel(point, &pixel) &&
                  pixel.x() >= 0.0 && pixel.y() >= 0.0 && pixel.x() <= photo.cols - 1.0 &&
                  pixel.y() <= photo.rows - 1.0;
      for (std::size_t i = 0; seen && i < others.size(); ++i)
        seen = others[i].name == patch.name || !Hides(others[i], eye, point);
      map.at<cv::Vec2f>(row, column) = {static_cast<float>(pixel.x()),
                                        static_cast<float>(pixel.y())};
      if (seen) alpha.at<std::uint8_t>(row, column) = 255;
    }
  }
  cv::Mat color, texture;
  cv::remap(photo, color, map, cv::noArray(), cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  cv::cvtColor(color, texture, color.channels() == 1 ? cv::COLOR_GRAY2BGRA : cv::COLOR_BGR2BGRA);
  cv::insertChannel(alpha, texture, 3);
  return texture;
}

}  // namespace circline::apps
