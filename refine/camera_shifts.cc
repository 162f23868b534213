#include "circline/refine/camera_shifts.h"

#include <cmath>
#include <cstddef>

namespace circline {

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
