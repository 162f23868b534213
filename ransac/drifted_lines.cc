#include "circline/ransac/drifted_lines.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <cmath>

#include "circline/estimators/basics.h"

namespace circline {

// A line is known least where it turns about its middle.
Eigen::Vector3d MiddleOf(const LineFit& line) {
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(line.covariance);
  const Eigen::Vector3d middle = line.line.cross(eigen.eigenvectors().col(2)).normalized();
  return middle.z() < 0.0 ? Eigen::Vector3d(-middle) : middle;
}

double DriftRatio(const Eigen::Vector3d& middle, const Eigen::Vector3d& direction,
                  const Eigen::Vector3d& other) {
  // Of the angle, on the photos of kDriftShare: the most are within 4 degrees, hardly any
  // beyond 10.
  constexpr double kSigma = 5.0 * kDegree;
  const Eigen::Vector3d a = middle.cross(direction), b = middle.cross(other);
  const double off = std::atan2(a.cross(b).norm(), std::abs(a.dot(b))) / kSigma;
  return std::sqrt(0.5 * kPi) / kSigma * std::exp(-0.5 * off * off);
}

}  // namespace circline
