// A calibrated camera: from a pixel of the photo to a ray and back, and what one pixel is worth
// there.
//
// Frames (the whole library): camera x right, y down, z forward. Pixel centres lie at integer
// coordinates (OpenCV's convention). "Calibrated" coordinates x = (X/Z, Y/Z) are those of the
// undistorted image plane z = 1, where the image of the absolute conic is the identity.
// "Pixel" always means a pixel of the photo as taken, lens distortion included.
#ifndef CIRCLINE_ESTIMATORS_CAMERA_H_
#define CIRCLINE_ESTIMATORS_CAMERA_H_

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

#include "circline/estimators/export.h"
#include "circline/estimators/status.h"

namespace CIRCLINE_EXPORT circline {

// Which lens, and so what Camera::distortion means.
enum class CameraModel {
  kPinhole,  // No distortion.
  kOpenCV,   // Brown-Conrady, OpenCV's order: k1 k2 p1 p2 [k3 [k4 k5 k6]].
  kFisheye,  // Kannala-Brandt, OpenCV's fisheye module: k1 k2 k3 k4.
};

// Intrinsics of a camera, as a calibration gives them.
struct Camera {
  std::string id;                             // Photos with the same id share the camera.
  CameraModel model = CameraModel::kPinhole;  // Says what `distortion` means.
  int width = 0, height = 0;                  // Size of the photo, pixels; 0 = unknown.
  double fx = 0.0, fy = 0.0;                  // Focal lengths, pixels; must be positive.
  double cx = 0.0, cy = 0.0;                  // Principal point, pixels.
  std::array<double, 8> distortion{};         // As the model orders them; unused ones are 0.

  // Ok, or a sentence that names the field which is wrong.
  Status Validate() const;
};

// One pixel seen through the camera.
struct CalibratedPoint {
  Eigen::Vector2d x = Eigen::Vector2d::Zero();  // Calibrated coordinates.
  // d x / d pixel, 2x2 row-major. The gradient g of a function of x is the gradient
  // GradientPerPixel(g) of the same function on the photo, so that f / |GradientPerPixel(g)| is
  // the (first-order) distance to the curve f = 0 in pixels of the photo, whatever the lens.
  std::array<double, 4> x_from_pixel{1.0, 0.0, 0.0, 1.0};

  // (x, y, 1): the ray of the pixel, camera frame.
  Eigen::Vector3d Homogeneous() const { return {x.x(), x.y(), 1.0}; }
  // The gradient on the photo, per pixel, of a function whose gradient is g by x.
  Eigen::Vector2d GradientPerPixel(const Eigen::Vector2d& g) const {
    return {x_from_pixel[0] * g.x() + x_from_pixel[2] * g.y(),
            x_from_pixel[1] * g.x() + x_from_pixel[3] * g.y()};
  }
};

// Undistorts `pixel`. False, with `point` untouched, where the answer is not usable: a non-finite
// pixel, a ray 89 degrees or more off the optical axis, or a pixel outside the range in which the
// distortion polynomial is one-to-one. `camera` must be valid. 10 ns without distortion, ~200 ns
// with.
bool PixelToCalibrated(const Camera& camera, const Eigen::Vector2d& pixel, CalibratedPoint* point);

// The same for many; what cannot be used is left out and counted. `indices` (optional) receives,
// for every point written, its position in `pixels`. Returns how many were dropped.
int PixelsToCalibrated(const Camera& camera, const std::vector<Eigen::Vector2d>& pixels,
                       std::vector<CalibratedPoint>* points, std::vector<int>* indices = nullptr);

// Pixel of a point (or ray direction) in the camera frame. False behind the camera, 89 degrees or
// more off the axis, or outside the range in which the distortion is one-to-one.
bool CameraToPixel(const Camera& camera, const Eigen::Vector3d& X_cam, Eigen::Vector2d* pixel);

// d pixel / d x at calibrated point x, 2x2 row-major, and the pixel itself. No range check.
void DistortWithJacobian(const Camera& camera, const Eigen::Vector2d& x, Eigen::Vector2d* pixel,
                         std::array<double, 4>* pixel_from_x);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_CAMERA_H_
