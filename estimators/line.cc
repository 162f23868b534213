#include "circline/estimators/line.h"

#include <Eigen/Dense>
#include <cmath>

#include "circline/estimators/directions.h"
#include "circline/estimators/geometric_residuals.h"
#include "circline/estimators/weights.h"

namespace circline {
namespace {

// Orthogonal regression in calibrated coordinates. False where the points coincide.
bool RegressLine(const std::vector<CalibratedPoint>& points, const std::vector<double>* weights,
                 Eigen::Vector3d* line) {
  double sum = 0.0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (std::size_t i = 0; i < points.size(); ++i) {
    sum += WeightAt(weights, i);
    mean += WeightAt(weights, i) * points[i].x;
  }
  if (!(sum > 0.0)) return false;
  mean /= sum;
  double xx = 0.0, xy = 0.0, yy = 0.0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector2d d = points[i].x - mean;
    xx += WeightAt(weights, i) * d.x() * d.x();
    xy += WeightAt(weights, i) * d.x() * d.y();
    yy += WeightAt(weights, i) * d.y() * d.y();
  }
  constexpr double kMinSpread =
      1e-10;  // Calibrated units: points closer than rounding make no line.
  if (!(xx + yy > kMinSpread * kMinSpread * sum * (1.0 + mean.squaredNorm()))) return false;
  const double angle = 0.5 * std::atan2(2.0 * xy, xx - yy);  // Of the direction.
  const Eigen::Vector2d normal(-std::sin(angle), std::cos(angle));
  *line = Eigen::Vector3d(normal.x(), normal.y(), -normal.dot(mean)).normalized();
  return true;
}

}  // namespace

LineFit WithDirectionError(const LineFit& fit, double sigma_rad) {
  LineFit result = fit;
  result.covariance +=
      sigma_rad * sigma_rad *
      (Eigen::Matrix3d::Identity() - fit.line * fit.line.transpose() / fit.line.squaredNorm());
  return result;
}

Status FitLine(const std::vector<CalibratedPoint>& points, double sigma_px, LineFit* fit,
               const std::vector<double>* weights) {
  if (points.size() < 2) return Status::Refused("a line needs two points");
  Eigen::Vector3d line;
  if (!RegressLine(points, weights, &line))
    return Status::Refused("the points of the line coincide");

  Eigen::Matrix<double, 3, 2> basis;
  Eigen::Matrix2d covariance;  // In that basis, for a noise of 1 px.
  double cost = 0.0, sum = 0.0;
  // The distance is measured in the photo, so the metric changes along a distorted line: the
  // regression is the start, Gauss-Newton on the sphere of lines the answer.
  constexpr int kPasses = 3;
  for (int pass = 0; pass < kPasses; ++pass) {
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    cost = sum = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const CalibratedPoint& p = points[i];
      Eigen::Vector3d jacobian;
      const double r = LineDistance(p, line, &jacobian);
      const double w = WeightAt(weights, i);
      information += w * jacobian * jacobian.transpose();
      gradient += w * r * jacobian;
      cost += w * r * r;
      sum += w;
    }
    basis = BasisAcross(line);
    covariance = (basis.transpose() * information * basis).inverse();
    if (!covariance.allFinite()) return Status::Refused("the points of the line coincide");
    if (pass + 1 == kPasses) break;
    line = (line - basis * (covariance * (basis.transpose() * gradient))).normalized();
  }
  fit->line = line;
  fit->covariance = basis * (sigma_px * sigma_px * covariance) * basis.transpose();
  fit->rms_px = std::sqrt(cost / sum);
  return Status::Ok();
}

}  // namespace circline
