// Vanishing points. In calibrated coordinates the vanishing point of a direction IS the direction:
// a unit 3-vector without sense of sign, at infinity in the image or not.
#ifndef CIRCLINE_ESTIMATORS_VANISHING_POINT_H_
#define CIRCLINE_ESTIMATORS_VANISHING_POINT_H_

#include <Eigen/Core>
#include <vector>

#include "circline/estimators/export.h"
#include "circline/estimators/line.h"
#include "circline/estimators/status.h"

namespace CIRCLINE_EXPORT circline {

// The direction of a pencil, and how well it is known.
struct VanishingPointFit {
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();   // Unit, camera frame, without sense.
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // Of `direction`, rank 2, rad^2.
};

// Maximum-likelihood direction common to two or more lines: minimises
// sum_i (l_i . v)^2 / (v^T Cov(l_i) v) over unit v, so that long segments count for more than short
// ones, by damped Gauss-Newton steps from the eigenvector of the weighted scatter. Refuses fewer
// than two lines, and lines that all coincide. `weights` (optional, one per line) multiply the
// terms. `second` (optional): where the lines lie so near one line of the photo that a direction
// across, along that line, may compete, it receives that direction; else it is left as it is.
Status FitVanishingPoint(const std::vector<LineFit>& lines, VanishingPointFit* fit,
                         const std::vector<double>* weights = nullptr,
                         VanishingPointFit* second = nullptr);

// How far a line misses a direction, in standard deviations of the line: l.v / sqrt(v^T Cov v).
double VanishingPointResidual(const LineFit& line, const Eigen::Vector3d& direction);

// How far two measured directions, which have no sense, are apart: their difference in standard
// deviations (Mahalanobis), which for the same direction exceeds 3.7 in one case of a thousand.
double DirectionSeparation(const VanishingPointFit& a, const VanishingPointFit& b);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_VANISHING_POINT_H_
