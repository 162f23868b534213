#include "circline/estimators/camera.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace circline {
namespace {

constexpr double kMaxTanAngle = 57.289961630759;  // tan 89 degrees.

// Radial factor f(s) of the Brown-Conrady model and its derivative, s = r^2.
struct RadialFactor {
  double f, df;
};

RadialFactor BrownConradyRadial(const std::array<double, 8>& k, double s) {
  const double n = 1.0 + s * (k[0] + s * (k[1] + s * k[4]));
  const double dn = k[0] + s * (2.0 * k[1] + s * 3.0 * k[4]);
  const double d = 1.0 + s * (k[5] + s * (k[6] + s * k[7]));
  const double dd = k[5] + s * (2.0 * k[6] + s * 3.0 * k[7]);
  return {n / d, (dn * d - n * dd) / (d * d)};
}

// Radial factor theta_d / r of the Kannala-Brandt model, theta = atan r.
RadialFactor KannalaBrandtRadial(const std::array<double, 8>& k, double s) {
  const double t = s < 1e-16 ? 1.0 : std::atan(std::sqrt(s)) / std::sqrt(s);  // theta / r
  const double q = s * t * t;                                                 // theta^2
  const double poly = 1.0 + q * (k[0] + q * (k[1] + q * (k[2] + q * k[3])));
  const double dpoly =
      1.0 + q * (3.0 * k[0] + q * (5.0 * k[1] + q * (7.0 * k[2] + q * 9.0 * k[3])));
  const double f = t * poly;
  // d(theta_d)/dr = dpoly / (1 + s) and theta_d = r f, hence 2 s f' = d(theta_d)/dr - f.
  const double df = s < 1e-8 ? k[0] - 1.0 / 3.0 : (dpoly / (1.0 + s) - f) / (2.0 * s);
  return {f, df};
}

RadialFactor Radial(const Camera& camera, double s) {
  return camera.model == CameraModel::kFisheye ? KannalaBrandtRadial(camera.distortion, s)
                                               : BrownConradyRadial(camera.distortion, s);
}

// Whether the terms of the radial polynomial are too small for its slope 1 + 3 k1 s + 5 k2 s^2 + ..
// to vanish anywhere from the axis to s; s is theta^2 for the fisheye model.
bool IsMildlyDistorted(const Camera& camera, double s) {
  const std::array<double, 8>& k = camera.distortion;
  if (camera.model == CameraModel::kFisheye) {
    const double q = std::min(s, 2.5);  // theta^2 < r^2, and theta < pi/2.
    return q * (3.0 * std::abs(k[0]) +
                q * (5.0 * std::abs(k[1]) +
                     q * (7.0 * std::abs(k[2]) + q * 9.0 * std::abs(k[3])))) <
           1.0;
  }
  const bool is_polynomial = k[5] == 0.0 && k[6] == 0.0 && k[7] == 0.0;
  return is_polynomial &&
         s * (3.0 * std::abs(k[0]) + s * (5.0 * std::abs(k[1]) + s * 7.0 * std::abs(k[4]))) < 1.0;
}

// Whether the distorted radius grows with the true one all the way from the axis to r^2 = s: beyond
// a turning point a pixel would have several rays.
bool IsOneToOne(const Camera& camera, double s) {
  if (camera.model == CameraModel::kPinhole || IsMildlyDistorted(camera, s)) return true;
  constexpr int kSteps = 8;  // The derivative is a polynomial of degree 3 or 4 in s.
  for (int i = 1; i <= kSteps; ++i) {
    const double si = s * i / kSteps;
    const RadialFactor radial = Radial(camera, si);
    if (!(radial.f + 2.0 * si * radial.df > 0.0) || !(radial.f > 0.0)) return false;
  }
  return true;
}

struct Distorted {
  Eigen::Vector2d x;
  Eigen::Matrix2d jacobian;  // d distorted / d undistorted, both without focal length.
};

Distorted Distort(const Camera& camera, const Eigen::Vector2d& x) {
  if (camera.model == CameraModel::kPinhole) return {x, Eigen::Matrix2d::Identity()};
  const double s = x.squaredNorm();
  const RadialFactor radial = Radial(camera, s);
  Distorted out{radial.f * x, 2.0 * radial.df * x * x.transpose()};
  out.jacobian.diagonal().array() += radial.f;
  if (camera.model == CameraModel::kOpenCV) {
    const double p1 = camera.distortion[2], p2 = camera.distortion[3];
    out.x.x() += 2.0 * p1 * x.x() * x.y() + p2 * (s + 2.0 * x.x() * x.x());
    out.x.y() += p1 * (s + 2.0 * x.y() * x.y()) + 2.0 * p2 * x.x() * x.y();
    const double mixed = 2.0 * (p1 * x.x() + p2 * x.y());
    out.jacobian(0, 0) += 2.0 * p1 * x.y() + 6.0 * p2 * x.x();
    out.jacobian(0, 1) += mixed;
    out.jacobian(1, 0) += mixed;
    out.jacobian(1, 1) += 6.0 * p1 * x.y() + 2.0 * p2 * x.x();
  }
  return out;
}

}  // namespace

Status Camera::Validate() const {
  const auto wrong = [this](const char* what) {
    return Status::Invalid((id.empty() ? "camera" : "camera '" + id + "'") + ": " + what);
  };
  constexpr double kMinFocal = 1e-3, kMaxFocal = 1e9;  // Pixels; squares stay far from overflow.
  for (double f : {fx, fy}) {
    if (!(f >= kMinFocal) || !(f <= kMaxFocal)) {
      return wrong("the focal lengths fx, fy must be positive pixels, 1e-3 to 1e9 (camera_matrix)");
    }
  }
  if (!std::isfinite(cx) || !std::isfinite(cy)) {
    return wrong("the principal point cx, cy must be finite (camera_matrix)");
  }
  if (width < 0 || height < 0) return wrong("width and height must not be negative");
  for (double k : distortion) {
    if (!std::isfinite(k)) return wrong("distortion must be finite");
    if (model == CameraModel::kPinhole && k != 0.0)
      return wrong("a pinhole camera has no distortion: say model 'opencv'");
  }
  return Status::Ok();
}

bool PixelToCalibrated(const Camera& camera, const Eigen::Vector2d& pixel, CalibratedPoint* point) {
  const Eigen::Vector2d target((pixel.x() - camera.cx) / camera.fx,
                               (pixel.y() - camera.cy) / camera.fy);
  if (!target.allFinite()) return false;
  Eigen::Vector2d x = target;
  if (camera.model == CameraModel::kFisheye) {
    // tan is steep: start where an equidistant lens would have the pixel, not near the edge.
    constexpr double kMaxStart = 1.0;  // Radians.
    const double distorted = target.norm();
    if (distorted > 1e-8) x = target * (std::tan(std::min(distorted, kMaxStart)) / distorted);
  }
  Distorted d = Distort(camera, x);
  if (camera.model != CameraModel::kPinhole) {
    // Newton, damped: rational and high-order polynomials bend where a full step overshoots.
    constexpr int kMaxIterations = 50;
    for (int i = 0; i < kMaxIterations; ++i) {
      const Eigen::Vector2d miss = target - d.x;
      Eigen::Vector2d step = d.jacobian.inverse() * miss;
      if (!step.allFinite()) return false;
      constexpr double kSmallestStep = 1e-3;
      Distorted next = Distort(camera, x + step);
      for (double size = 0.5; size > kSmallestStep; size *= 0.5) {
        if ((target - next.x).squaredNorm() <= miss.squaredNorm()) break;
        step *= 0.5;
        next = Distort(camera, x + step);
      }
      x += step;
      d = next;
      // Newton converges quadratically: after a step of 1e-8 the error is rounding.
      if (step.squaredNorm() <= 1e-16 * (1.0 + x.squaredNorm())) break;
    }
    constexpr double kTolerance = 1e-10;  // Calibrated units: 1e-7 px at a focal length of 1000 px.
    if (!((d.x - target).norm() < kTolerance * (1.0 + target.norm()))) return false;
  }
  const double s = x.squaredNorm();
  if (!(s < kMaxTanAngle * kMaxTanAngle) || !IsOneToOne(camera, s)) return false;
  if (!(d.jacobian.determinant() > 0.0)) return false;
  point->x = x;
  const Eigen::Matrix2d inverse = d.jacobian.inverse();
  point->x_from_pixel = {inverse(0, 0) / camera.fx, inverse(0, 1) / camera.fy,
                         inverse(1, 0) / camera.fx, inverse(1, 1) / camera.fy};
  return true;
}

int PixelsToCalibrated(const Camera& camera, const std::vector<Eigen::Vector2d>& pixels,
                       std::vector<CalibratedPoint>* points, std::vector<int>* indices) {
  points->clear();
  points->reserve(pixels.size());
  if (indices != nullptr) indices->clear();
  CalibratedPoint point;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    if (!PixelToCalibrated(camera, pixels[i], &point)) continue;
    points->push_back(point);
    if (indices != nullptr) indices->push_back(static_cast<int>(i));
  }
  return static_cast<int>(pixels.size() - points->size());
}

bool CameraToPixel(const Camera& camera, const Eigen::Vector3d& X_cam, Eigen::Vector2d* pixel) {
  if (!(X_cam.z() > 0.0) || !X_cam.allFinite()) return false;
  const Eigen::Vector2d x = X_cam.head<2>() / X_cam.z();
  const double s = x.squaredNorm();
  if (!(s < kMaxTanAngle * kMaxTanAngle) || !IsOneToOne(camera, s)) return false;
  const Eigen::Vector2d d = Distort(camera, x).x;
  *pixel = Eigen::Vector2d(camera.fx * d.x() + camera.cx, camera.fy * d.y() + camera.cy);
  return pixel->allFinite();
}

void DistortWithJacobian(const Camera& camera, const Eigen::Vector2d& x, Eigen::Vector2d* pixel,
                         std::array<double, 4>* pixel_from_x) {
  const Distorted d = Distort(camera, x);
  *pixel = Eigen::Vector2d(camera.fx * d.x.x() + camera.cx, camera.fy * d.x.y() + camera.cy);
  *pixel_from_x = {camera.fx * d.jacobian(0, 0), camera.fx * d.jacobian(0, 1),
                   camera.fy * d.jacobian(1, 0), camera.fy * d.jacobian(1, 1)};
}

}  // namespace circline
