#include "apps/reconstruct/box_picture.h"

#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "apps/common/text.h"
#include "apps/compare/canvas.h"
#include "apps/compare/pose_curves.h"
#include "apps/reconstruct/box_geometry.h"

namespace circline::apps {
namespace {

const cv::Scalar kColors[] = {{60, 60, 255}, {60, 220, 60}, {255, 140, 40}};
const cv::Scalar kPoints(0, 230, 255), kLetters(255, 255, 255);

// Straight in space, bent by the lens.
PixelCurve EdgeCurve(const BoxFit& fit, int from, int to) {
  const Eigen::Vector3d a = BoxCorner(fit.length, from), b = BoxCorner(fit.length, to);
  return ProjectCurve(fit.camera, 16, 0.0, 1.0,
                      [&](double t) { return fit.InCamera(a + t * (b - a)); });
}

// An edge is seen where one of its two faces is.
bool IsSeen(const BoxFit& fit, int corner, int axis) {
  for (int k = 0; k < 3; ++k) {
    if (k != axis && FaceIsSeen(fit.cam_from_box, fit.length, k, (corner >> k & 1) != 0))
      return true;
  }
  return false;
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
      if (!IsSeen(fit, corner, axis)) {
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

}  // namespace circline::apps
