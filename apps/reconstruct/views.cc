#include "apps/reconstruct/views.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "apps/common/text.h"
#include "apps/compare/canvas.h"
#include "apps/compare/pose_curves.h"
#include "apps/reconstruct/box_geometry.h"
#include "circline/estimators/basics.h"

namespace circline::apps {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// ---- A box on the photo ----

const cv::Scalar kColors[] = {{60, 60, 255}, {60, 220, 60}, {255, 140, 40}};
const cv::Scalar kPoints(0, 230, 255), kLetters(255, 255, 255);

// Straight in space, bent by the lens.
PixelCurve EdgeCurve(const BoxFit& fit, int from, int to) {
  const Eigen::Vector3d a = BoxCorner(fit.length, from), b = BoxCorner(fit.length, to);
  return ProjectCurve(fit.camera, 16, 0.0, 1.0,
                      [&](double t) { return fit.InCamera(a + t * (b - a)); });
}

// ---- The model ----

const cv::Vec3b kGround(245, 243, 240), kBehind(170, 170, 170);
constexpr int kFiner = 2;      // Rendered so many times as large, then averaged.
constexpr int kMostPx = 1600;  // Longer side of the photo in the picture, and of each view.

struct Corner {
  Vector2d pixel;
  double inverse_depth;
  Vector2d texture;  // (s, t).
};

// The model as a pinhole camera sees it (BGR), on a light ground; what is transparent shows what is
// behind it. Surfaces seen from behind are grey.
class Renderer {
 public:
  Renderer(const Camera& camera, const CameraPose& pose)
      : camera_(camera),
        pose_(pose),
        picture_(camera.height, camera.width, CV_8UC3,
                 cv::Scalar(kGround[0], kGround[1], kGround[2])),
        inverse_depth_(camera.height, camera.width, CV_32F, cv::Scalar(0.0)) {}

  void Draw(const Patch& patch) {
    const Mesh mesh = MeshOf(patch);
    for (const auto& triangle : Triangles(mesh)) {
      std::array<Corner, 3> corners;
      bool before = true;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vector3d x = pose_.rotation * mesh.points[triangle[k]] + pose_.translation;
        before = before && x.z() > 0.0;
        corners[k] = {
            {camera_.fx * x.x() / x.z() + camera_.cx, camera_.fy * x.y() / x.z() + camera_.cy},
            1.0 / x.z(),
            mesh.texture[triangle[k]]};
      }
      if (before) Fill(corners, patch.texture);
    }
  }

  const cv::Mat& picture() const { return picture_; }

 private:
  // Depths by barycentric coordinates; y runs down, so that what is seen from outside is negative.
  void Fill(const std::array<Corner, 3>& c, const cv::Mat& texture) {
    const Vector2d a = c[0].pixel, ab = c[1].pixel - a, ac = c[2].pixel - a;
    const double area = Cross(ab, ac);
    if (!(std::abs(area) > 1e-9)) return;
    const auto range = [](double p, double q, double r, int size) {
      const double least = std::min({p, q, r}), most = std::max({p, q, r});
      return std::array<int, 2>{static_cast<int>(std::clamp(std::ceil(least), 0.0, size - 1.0)),
                                static_cast<int>(std::clamp(std::floor(most), -1.0, size - 1.0))};
    };
    const auto columns = range(a.x(), c[1].pixel.x(), c[2].pixel.x(), picture_.cols);
    const auto rows = range(a.y(), c[1].pixel.y(), c[2].pixel.y(), picture_.rows);
    for (int y = rows[0]; y <= rows[1]; ++y) {
      for (int x = columns[0]; x <= columns[1]; ++x) {
        const Vector2d p = Vector2d(x, y) - a;
        const double w1 = Cross(p, ac) / area, w2 = Cross(ab, p) / area, w0 = 1.0 - w1 - w2;
        if (w0 < 0.0 || w1 < 0.0 || w2 < 0.0) continue;
        const double inverse =
            w0 * c[0].inverse_depth + w1 * c[1].inverse_depth + w2 * c[2].inverse_depth;
        const auto near = static_cast<float>(inverse);
        float& nearest = inverse_depth_.at<float>(y, x);
        if (near <= nearest) continue;
        const Vector2d st =
            (w0 * c[0].inverse_depth * c[0].texture + w1 * c[1].inverse_depth * c[1].texture +
             w2 * c[2].inverse_depth * c[2].texture) /
            inverse;
        cv::Vec3b color;
        if (!Color(texture, st, area > 0.0, &color)) continue;
        picture_.at<cv::Vec3b>(y, x) = color;
        nearest = near;
      }
    }
  }

  static bool Color(const cv::Mat& texture, const Vector2d& st, bool behind, cv::Vec3b* color) {
    const int x = std::clamp(static_cast<int>(st.x() * texture.cols), 0, texture.cols - 1);
    const int y = std::clamp(static_cast<int>((1.0 - st.y()) * texture.rows), 0, texture.rows - 1);
    const auto& texel = texture.at<cv::Vec4b>(y, x);
    if (texel[3] < 128) return false;
    *color = behind ? kBehind : cv::Vec3b(texel[0], texel[1], texel[2]);
    return true;
  }

  const Camera& camera_;
  const CameraPose& pose_;
  cv::Mat picture_, inverse_depth_;
};

Eigen::AlignedBox3d Extent(const Model& model) {
  Eigen::AlignedBox3d extent;
  for (const Patch& patch : model.patches) {
    for (const Vector3d& point : MeshOf(patch).points) extent.extend(point);
  }
  return extent;
}

CameraPose LookAt(const Vector3d& center, double azimuth, double elevation, double distance) {
  const Vector3d back(std::cos(elevation) * std::cos(azimuth),
                      std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
  CameraPose pose;
  const Vector3d z = -back, x = z.cross(Vector3d::UnitZ()).normalized(), y = z.cross(x);
  pose.rotation.row(0) = x;
  pose.rotation.row(1) = y;
  pose.rotation.row(2) = z;
  pose.translation = -(pose.rotation * (center + distance * back));
  return pose;
}

}  // namespace

cv::Mat DrawBox(const cv::Mat& photo, const BoxObservation& box, const BoxFit& fit) {
  Canvas canvas(photo);
  std::array<bool, 3> labelled{};
  std::vector<std::pair<Eigen::Vector2d, std::string>> labels;
  for (int axis = 0; axis < 3; ++axis) {
    const cv::Scalar& color = kColors[axis];
    for (int corner = 0; corner < 8; ++corner) {
      if ((corner >> axis & 1) != 0) continue;
      const PixelCurve curve = EdgeCurve(fit, corner, corner | 1 << axis);
      if (NumSeenFaces(fit, axis, corner) == 0) {
        canvas.Dashes(curve, color, 1.0);
        continue;
      }
      canvas.Polyline(curve, color, 2.0);
      const auto k = static_cast<std::size_t>(axis);
      if (labelled[k]) continue;
      labelled[k] = true;
      labels.emplace_back(curve[curve.size() / 2],
                          std::string(1, "xyz"[axis]) + " " + FormatShort(fit.length[axis]) +
                              " +- " + FormatShort(std::sqrt(fit.covariance(6 + axis, 6 + axis))));
    }
  }
  for (const std::size_t e : fit.edges) {
    for (const Eigen::Vector2d& point : box.edges[e].points) canvas.Dot(point, 1.5, kPoints);
  }
  for (const auto& [at, text] : labels) canvas.Label(at, text, kLetters, 0.6);
  return canvas.Image();
}

cv::Mat ModelViews(const cv::Mat& photo, const Model& model, const CameraPose& pose,
                   const std::string& title, const std::vector<std::string>& caption) {
  const double scale = static_cast<double>(kMostPx) / std::max(photo.cols, photo.rows);
  cv::Mat shown = photo;
  if (scale < 1.0) cv::resize(photo, shown, cv::Size(), scale, scale, cv::INTER_AREA);
  const Eigen::AlignedBox3d extent = Extent(model);
  const Vector3d center = extent.center();
  const double radius = 0.5 * extent.diagonal().norm();
  const Vector3d eye = -(pose.rotation.transpose() * pose.translation), back = eye - center;
  const double azimuth = std::atan2(back.y(), back.x());
  const double side = back.z() < 0.0 ? -1.0 : 1.0;  // Seen from below in the photo and here.
  Camera camera;
  camera.width = kFiner * shown.cols;
  camera.height = kFiner * shown.rows;
  constexpr double kDistance = 3.5;  // In radii of the model, which then fills the picture.
  camera.fx = camera.fy = 0.48 * kDistance * std::min(camera.width, camera.height);
  camera.cx = 0.5 * (camera.width - 1);
  camera.cy = 0.5 * (camera.height - 1);
  std::vector<cv::Mat> pictures = {shown};
  // From the photo's own azimuth, and over the plane; degrees.
  constexpr double kSides[3][2] = {{-35.0, 30.0}, {35.0, 30.0}, {0.0, 70.0}};
  for (const auto& from : kSides) {
    const CameraPose view =
        LookAt(center, azimuth + from[0] * kDegree, side * from[1] * kDegree, kDistance * radius);
    Renderer renderer(camera, view);
    for (const Patch& patch : model.patches) renderer.Draw(patch);
    cv::Mat small;
    cv::resize(renderer.picture(), small, shown.size(), 0.0, 0.0, cv::INTER_AREA);
    pictures.push_back(small);
  }
  cv::Mat above, below, all;
  cv::hconcat(pictures[0], pictures[1], above);
  cv::hconcat(pictures[2], pictures[3], below);
  cv::vconcat(above, below, all);
  return Canvas(all).WithCaption(title, caption);
}

}  // namespace circline::apps
