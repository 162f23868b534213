// Where noisy points of a contour lie on average. Internal: not installed.
#ifndef CIRCLINE_REFINE_CURVATURE_BIAS_H_
#define CIRCLINE_REFINE_CURVATURE_BIAS_H_

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <vector>

#include "circline/estimators/camera.h"

namespace circline {

// Points of an ellipse whose both coordinates have noise lie outside of it by kappa sigma^2 / 2 on
// average, kappa the curvature: noise along the contour leads away from it. In one photo that is
// little against the noise; over many frames, which average the noise out, it tilts small and steep
// ellipses by up to a standard deviation. `moved`: the points, back by that along the normals of a
// fit (calibrated, negative inside).
inline void RemoveCurvatureBias(const Camera& camera, const std::vector<Eigen::Vector2d>& pixels,
                                const Eigen::Matrix3d& conic, double sigma_px,
                                std::vector<Eigen::Vector2d>* moved) {
  *moved = pixels;
  for (Eigen::Vector2d& pixel : *moved) {
    CalibratedPoint p;
    if (!PixelToCalibrated(camera, pixel, &p)) continue;
    // The curve's foot of the point, by Newton's method along the gradient.
    constexpr int kSteps = 2;
    Eigen::Vector2d gradient;
    Eigen::Vector3d foot = p.Homogeneous();
    for (int i = 0; i < kSteps; ++i) {
      gradient = 2.0 * (conic * foot).head<2>();
      foot.head<2>() -= foot.dot(conic * foot) / gradient.squaredNorm() * gradient;
    }
    gradient = 2.0 * (conic * foot).head<2>();
    const Eigen::Map<const Eigen::Matrix<double, 2, 2, Eigen::RowMajor>> J(p.x_from_pixel.data());
    const Eigen::Vector2d on_photo = J.transpose() * gradient, normal = on_photo.normalized();
    const Eigen::Vector2d along = J * Eigen::Vector2d(-normal.y(), normal.x());
    const double curvature = 2.0 * along.dot(conic.topLeftCorner<2, 2>() * along) / on_photo.norm();
    // The expansion holds where the noise is below the radius of curvature.
    const double bend = std::min(1.0, curvature * sigma_px);
    const Eigen::Vector2d back = pixel - 0.5 * sigma_px * bend * normal;
    if (back.allFinite()) pixel = back;
  }
}

}  // namespace circline

#endif  // CIRCLINE_REFINE_CURVATURE_BIAS_H_
