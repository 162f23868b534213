// A camera as unknowns of a refinement.
#ifndef CIRCLINE_REFINE_CAMERA_SHIFTS_H_
#define CIRCLINE_REFINE_CAMERA_SHIFTS_H_

#include <Eigen/Core>
#include <array>
#include <cmath>

#include "circline/estimators/camera.h"
#include "circline/estimators/export.h"
#include "circline/estimators/noise_model.h"

namespace CIRCLINE_EXPORT circline {

// Shifts against the camera as given, so that zeros are that camera. 0: of
// log f (both focal lengths); 1: of log (fy / fx); 2, 3: of the principal point, pixels; from 4 on:
// of the distortion coefficients.
constexpr int kCameraSize = 12;
using Shifts = std::array<double, kCameraSize>;
// Standard deviations; of the coefficients of a lens, where the camera has one, only the first.
Shifts ShiftSigmas(const Camera& camera, const CameraSigma& sigma);
Camera ShiftedCamera(const Camera& camera, const double* shifts);
// A line and a point of calibrated coordinates of the camera as given, in those of the shifted one,
// lenses left out: x_given = exp(s0) x + s2 / fx, y_given = exp(s0 + s1) y + s3 / fy.
template <typename T>
Eigen::Matrix<T, 3, 1> ShiftedLine(const Camera& camera, const T* shifts,
                                   const Eigen::Vector3d& line) {
  using std::exp;
  return {exp(shifts[0]) * line.x(), exp(shifts[0] + shifts[1]) * line.y(),
          line.z() + line.x() * shifts[2] / camera.fx + line.y() * shifts[3] / camera.fy};
}
template <typename T>
Eigen::Matrix<T, 3, 1> ShiftedPoint(const Camera& camera, const T* shifts,
                                    const Eigen::Vector2d& point) {
  using std::exp;
  return {(point.x() - shifts[2] / camera.fx) * exp(-shifts[0]),
          (point.y() - shifts[3] / camera.fy) * exp(-shifts[0] - shifts[1]), static_cast<T>(1.0)};
}
// A pixel, undistorted by a shifted camera; `before`: by the camera `given`, which is where it is
// looked for. A pixel that no ray of the shifted camera meets, beyond where its lens turns back or
// at a right angle to its axis, is as far off as in the photo: the lens goes on as it is just
// before.
CalibratedPoint SeenThrough(const Camera& shifted, const Camera& given,
                            const Eigen::Vector2d& pixel, const CalibratedPoint& before);
// What one distortion coefficient does to a pixel. The models are linear in their coefficients but
// for the rational ones of kOpenCV (k4 to k6), for which it holds at 0.
class LensSlope {
 public:
  // Of coefficient k of this camera's model, 0 the first.
  LensSlope(const Camera& camera, int k);
  // d pixel / d coefficient of a point at calibrated x, and of d pixel / d x (may be null).
  Eigen::Vector2d At(const Camera& camera, const Eigen::Vector2d& x,
                     Eigen::Matrix2d* pixel_from_x) const;

 private:
  Camera lens_;  // Of unit focal length, with this coefficient alone.
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_CAMERA_SHIFTS_H_
