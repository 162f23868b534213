// The points of a contour or a line with the noise that they have, and that they share. Internal:
// not installed.
#ifndef CIRCLINE_REFINE_EVIDENCE_POINTS_H_
#define CIRCLINE_REFINE_EVIDENCE_POINTS_H_

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "circline/estimators/noise_model.h"
#include "circline/refine/estimate_pose.h"
#include "circline/refine/image_points.h"
#include "circline/refine/square_root.h"

namespace circline {

// `sigma_px`: of each coordinate, what neighbours share not included. Losses, distance and noise
// model are those of `how`; so many distortion coefficients have derivatives. False where there are
// too few points for a contour (5), a line (2).
inline bool FillEvidencePoints(const Camera& camera, const std::vector<Eigen::Vector2d>& pixels,
                               const std::vector<std::uint8_t>& inliers, double sigma_px,
                               bool is_contour, const EstimationOptions& how, int num_distortion,
                               ImagePoints* points) {
  if (pixels.empty()) return false;
  const NoiseModel& noise = how.noise_model;
  const double shared = is_contour ? noise.contour_px : noise.line_px;
  const double sigma = std::hypot(sigma_px, shared);
  points->Reset(camera, pixels, inliers,
                {sigma, 1.0, (is_contour ? how.conic_loss : how.line_loss).type, how.conic_distance,
                 num_distortion});
  if (points->size() < (is_contour ? 5U : 2U)) return false;
  const double weight = is_contour ? noise.ContourWeight(sigma_px, pixels, inliers)
                                   : noise.LineWeight(sigma_px, pixels, inliers);
  points->set_weight(weight * (sigma * sigma) / (sigma_px * sigma_px));
  return true;
}

// Standard deviation of a contour as a whole, pixels: no mark of its centre is better known.
inline double ContourSigma(const ImagePoints& points) {
  return points.options().sigma_px / std::sqrt(points.options().weight);
}

// What is known exactly has this share of the standard deviation that its own pixels give it, which
// adds a hundredth to variances. With less the cost has a bent valley, so narrow that the solver
// stops half-way along it.
inline constexpr double kExactShare = 0.1;

// Standard deviation of the better known component of a unit vector, that of a fitted direction or
// line.
inline double LeastSigma(const Eigen::Matrix3d& covariance) {
  constexpr double kLeast = 1e-5;  // Where the fit states none.
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> spread(covariance, Eigen::EigenvaluesOnly);
  return std::sqrt(std::max(kLeast * kLeast, spread.eigenvalues()[1]));  // [0]: along itself, 0.
}

// Of a circle's tilt and height (PlaneCircleContourCost); zeros where both are exact.
inline std::array<double, 3> TiltSigmas(const NoiseModel& noise) {
  constexpr double kExact = 1e-6;  // Stands for a standard deviation of 0.
  if (!(noise.circle_tilt_rad > 0.0) && !(noise.circle_height > 0.0)) return {0.0, 0.0, 0.0};
  const double tilt = std::max(noise.circle_tilt_rad, kExact);
  return {tilt, tilt, std::max(noise.circle_height, kExact)};
}

// Twice what the points cost under their loss at their own best curve, by one step from a fit.
inline double FreeTwiceCost(const ImagePoints& points, const Eigen::Matrix3d& conic) {
  CurveModel model;
  points.SumConic(conic, 0.0, nullptr, Weighing(), {}, &model);
  const SquareRoot<6> root(model.h, model.g, model.twice_cost, 5);
  return std::max(0.0, model.twice_cost - root.f.squaredNorm());
}

inline double FreeTwiceCost(const ImagePoints& points, const Eigen::Vector3d& line) {
  CurveModel model;
  points.SumLine(line, nullptr, Weighing(), false, &model);
  const SquareRoot<3> root(model.h, model.g, model.twice_cost, 2);
  return std::max(0.0, model.twice_cost - root.f.squaredNorm());
}

}  // namespace circline

#endif  // CIRCLINE_REFINE_EVIDENCE_POINTS_H_
