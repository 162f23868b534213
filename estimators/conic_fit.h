// From contour points to an ellipse in calibrated coordinates, with its covariance.
#ifndef CIRCLINE_ESTIMATORS_CONIC_FIT_H_
#define CIRCLINE_ESTIMATORS_CONIC_FIT_H_

#include <Eigen/Core>
#include <array>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/conic.h"
#include "circline/estimators/export.h"
#include "circline/estimators/status.h"

namespace CIRCLINE_EXPORT circline {

// The ellipse of a contour, and how well it is known.
struct ConicFit {
  Eigen::Matrix3d conic = Eigen::Matrix3d::Zero();  // Calibrated, normalised (NormalizeEllipse).
  // Of ConicToVector(conic), 6x6 row-major, rank 5: the conic itself is its null vector.
  std::array<double, 36> covariance{};
  double rms_px = 0.0;  // Root of the weighted mean squared distance, pixels of the photo.
  // How irregular the contour is, 1 = as NoiseModel::contour_px says; NoiseModel::circle_shape is
  // for such a one, and scaled by it. Filled in by FitDirect, FitObservations and the detection;
  // FitConic and RefineConic, which know no noise model, leave it.
  double irregularity = 1.0;

  // `covariance` as a matrix.
  Eigen::Map<const Matrix6d> Covariance() const {
    return Eigen::Map<const Matrix6d>(covariance.data());
  }
  // As if the points had sqrt(factor) times the noise.
  void ScaleCovariance(double factor) {
    for (double& entry : covariance) entry *= factor;
  }
};

// Maximum-likelihood ellipse: starts from FitConicDirect and minimises the orthogonal distances to
// the points in pixels of the photo (each with standard deviation `sigma_px`; the true distance
// along the normal, not its first-order approximation), damped, never leaving the set of ellipses.
// Where that is hard - short arcs, noise not small against the shorter axis - it also starts from a
// circle and keeps the better minimum. `weights` (optional, one per point) multiply the squared
// residuals. Refuses fewer than 5 points, and points that no ellipse explains (collinear, a
// hyperbola's branch).
//
// The covariance is the linearised one. The curve it describes is calibrated along the contour
// (NEES 5 +- 0.3) for whole ellipses up to a noise of a twentieth of the shorter semi-axis and for
// arcs of 90 degrees up to 2 % of the longer one. What a short arc says of the far side bends: the
// entries of the conic of a 90 degrees' arc are calibrated up to 0.5 %, and spread wider beyond.
// 12 us for 100 points of a whole ellipse, 17 us for an arc of 90 degrees. Allocates once, nothing
// with `memory` (optional) that has served as many points before.
Status FitConic(const std::vector<CalibratedPoint>& points, double sigma_px, ConicFit* fit,
                const std::vector<double>* weights = nullptr,
                std::vector<double>* memory = nullptr);

// Closed form: hyper-accurate algebraic least squares (Kanatani and Rangarajan 2011), and where
// that is not an ellipse, the ellipse-constrained least squares of Halir and Flusser 1998. 0.3 us,
// and 4 ns a point.
Status FitConicDirect(const std::vector<CalibratedPoint>& points, Eigen::Matrix3d* conic,
                      const std::vector<double>* weights = nullptr);

// Refines a given ellipse on the points (the second half of FitConic, from this start alone).
Status RefineConic(const std::vector<CalibratedPoint>& points, double sigma_px,
                   const Eigen::Matrix3d& initial, ConicFit* fit,
                   const std::vector<double>* weights = nullptr);

// Conic through five points, calibrated coordinates, as a member of the pencil spanned by two pairs
// of lines; no test of what kind of conic it is. False where four of the points are collinear.
// 20 ns.
bool ConicFromFivePoints(const std::array<Eigen::Vector2d, 5>& x, Eigen::Matrix3d* conic);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_CONIC_FIT_H_
