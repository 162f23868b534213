#include "circline/refine/camera_shifts.h"

#include <cmath>
#include <cstddef>

#include "circline/estimators/basics.h"
#include "circline/estimators/geometric_residuals.h"

namespace circline {
namespace {

std::array<double, 4> Inverse(const std::array<double, 4>& J) {
  const double inverse = 1.0 / (J[0] * J[3] - J[1] * J[2]);
  return {J[3] * inverse, -J[1] * inverse, -J[2] * inverse, J[0] * inverse};
}

// A pixel that no ray of a camera meets: one noisy point does not rule a camera out. `straight`:
// where the pixel would be without the lens.
CalibratedPoint BeyondLens(const Camera& camera, const Eigen::Vector2d& straight,
                           const Eigen::Vector2d& pixel) {
  constexpr int kSteps = 30;
  constexpr double kJustBefore = 0.995;  // Of the angle: 1/10 000 of the focal length before.
  const Eigen::Vector2d direction = straight.normalized();
  Eigen::Vector2d seen;
  double low = 0.0, high = 0.5 * kPi;
  for (int k = 0; k < kSteps; ++k) {
    const double angle = 0.5 * (low + high);
    const Eigen::Vector2d x = std::tan(angle) * direction;
    (CameraToPixel(camera, {x.x(), x.y(), 1.0}, &seen) ? low : high) = angle;
  }
  CalibratedPoint p;
  p.x = std::tan(kJustBefore * low) * direction;
  std::array<double, 4> J;
  DistortWithJacobian(camera, p.x, &seen, &J);
  p.x_from_pixel = Inverse(J);
  p.x += NormGradient(p, pixel - seen);
  return p;
}

}  // namespace

Shifts ShiftSigmas(const Camera& camera, const CameraSigma& sigma) {
  const double k1 = camera.model != CameraModel::kPinhole ? sigma.k1 : 0.0;
  return {sigma.log_focal, sigma.log_aspect, sigma.principal_point_px, sigma.principal_point_px,
          k1};
}

Camera ShiftedCamera(const Camera& camera, const double* shifts) {
  Camera shifted = camera;
  shifted.fx *= std::exp(shifts[0]);
  shifted.fy *= std::exp(shifts[0] + shifts[1]);
  shifted.cx += shifts[2];
  shifted.cy += shifts[3];
  for (std::size_t k = 0; k < camera.distortion.size(); ++k) shifted.distortion[k] += shifts[4 + k];
  return shifted;
}

// Newton's method, from where a camera without a lens would move the undistorted point.
CalibratedPoint SeenThrough(const Camera& shifted, const Camera& given,
                            const Eigen::Vector2d& pixel, const CalibratedPoint& before) {
  CalibratedPoint p = before;
  const Eigen::Vector2d focal(shifted.fx, shifted.fy), middle(shifted.cx, shifted.cy),
      straight = (pixel - middle).cwiseQuotient(focal);
  if (shifted.model == CameraModel::kPinhole) {
    p.x = straight;
    p.x_from_pixel = {1.0 / focal.x(), 0.0, 0.0, 1.0 / focal.y()};
    return p;
  }
  const auto move = [&p](const Eigen::Vector2d& pixels) { p.x += NormGradient(p, pixels); };
  move(Eigen::Vector2d(given.fx, given.fy).cwiseProduct(straight) +
       Eigen::Vector2d(given.cx, given.cy) - pixel);
  constexpr int kMaxSteps = 20;
  // Pixels, before the last step, which squares the error; a lens does not change over so little.
  constexpr double kConverged = 1e-3;
  double determinant = 1.0;
  for (int step = 0; step < kMaxSteps && determinant > 0.0; ++step) {
    Eigen::Vector2d seen;
    std::array<double, 4> J;
    DistortWithJacobian(shifted, p.x, &seen, &J);
    determinant = J[0] * J[3] - J[1] * J[2];
    p.x_from_pixel = Inverse(J);
    const Eigen::Vector2d miss = pixel - seen;
    move(miss);
    if (determinant > 0.0 && miss.squaredNorm() < kConverged * kConverged) return p;
  }
  return PixelToCalibrated(shifted, pixel, &p) ? p : BeyondLens(shifted, straight, pixel);
}

LensSlope::LensSlope(const Camera& camera, int k) {
  lens_.model = camera.model;
  lens_.fx = lens_.fy = 1.0;
  lens_.distortion[static_cast<std::size_t>(k)] = 1.0;
}

Eigen::Vector2d LensSlope::At(const Camera& camera, const Eigen::Vector2d& x,
                              Eigen::Matrix2d* pixel_from_x) const {
  Eigen::Vector2d bent;
  std::array<double, 4> J;
  DistortWithJacobian(lens_, x, &bent, &J);
  // A fisheye's own bending is there without coefficients, too.
  Eigen::Vector2d straight = x;
  std::array<double, 4> I = {1.0, 0.0, 0.0, 1.0};
  if (lens_.model == CameraModel::kFisheye) {
    Camera none = lens_;
    none.distortion = {};
    DistortWithJacobian(none, x, &straight, &I);
  }
  const Eigen::Vector2d f(camera.fx, camera.fy);
  if (pixel_from_x != nullptr) {
    *pixel_from_x << J[0] - I[0], J[1] - I[1], J[2] - I[2], J[3] - I[3];
    *pixel_from_x = f.asDiagonal() * *pixel_from_x;
  }
  return f.cwiseProduct(bent - straight);
}

}  // namespace circline
