// Lines in calibrated coordinates: unit 3-vectors l with l . (x, y, 1) = 0. In space, l is the
// normal of the plane through the camera centre and the line (its interpretation plane).
#ifndef CIRCLINE_ESTIMATORS_LINE_H_
#define CIRCLINE_ESTIMATORS_LINE_H_

#include <Eigen/Core>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/export.h"
#include "circline/estimators/status.h"

namespace CIRCLINE_EXPORT circline {

// The line through points, and how well it is known.
struct LineFit {
  Eigen::Vector3d line = Eigen::Vector3d::Zero();  // Unit; its sign has no meaning.
  Eigen::Matrix3d covariance =
      Eigen::Matrix3d::Zero();  // Of `line`, rank 2 (line is its null vector).
  double rms_px = 0.0;  // Of the points about the line, pixels of the photo; 0 for two points.
};

// The line with a further error, isotropic, of its normal: as of a line that misses the direction
// of its pencil.
LineFit WithDirectionError(const LineFit& fit, double sigma_rad);

// Maximum-likelihood line through two or more points: least squares of the distances in pixels of
// the photo, each with standard deviation `sigma_px`. Reweighted with the camera's local scale
// (two passes), so that lens distortion costs no accuracy. `weights` (optional, one per point)
// multiply the squared residuals. Refuses fewer than two points, or points that coincide.
// 0.3 us for two points, ~3 ns per further point.
Status FitLine(const std::vector<CalibratedPoint>& points, double sigma_px, LineFit* fit,
               const std::vector<double>* weights = nullptr);

// Distance of a point to a line, signed, pixels of the photo (first order in the distance).
inline double LineDistancePx(const CalibratedPoint& p, const Eigen::Vector3d& line) {
  const double value = line.x() * p.x.x() + line.y() * p.x.y() + line.z();
  return value / p.GradientPerPixel(line.head<2>()).norm();
}

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_LINE_H_
