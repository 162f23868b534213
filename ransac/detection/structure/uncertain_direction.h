// Directions, normals and circles with covariances, and what can be told from them: in the plane or
// not, at right angles or not. Each is a test with the propagated covariances, and with what no
// covariance of edge points knows.
#ifndef CIRCLINE_RANSAC_DETECTION_STRUCTURE_UNCERTAIN_DIRECTION_H_
#define CIRCLINE_RANSAC_DETECTION_STRUCTURE_UNCERTAIN_DIRECTION_H_

#include <Eigen/Core>
#include <array>
#include <vector>

#include "circline/estimators/conic_fit.h"
#include "circline/estimators/vanishing_point.h"

namespace circline {

// The walls of most houses are at right angles, to about so much (each pair, standard deviation).
constexpr double kRightAngleSigmaDeg = 0.7;

// Lines that are parallel in space miss their common direction by more than edges explain: in old
// streets and on hand-made things by a third of a degree, on paper that bends by more. Searches
// allow for this much, as NoiseModel::line_direction_rad does. Radians.
constexpr double kParallelSigmaRad = 3e-3;

// A unit vector (a normal, or a pencil's direction), its sense without meaning, and its covariance.
using UncertainDirection = VanishingPointFit;

// Whether two unit vectors are parallel within 3 degrees: they stand for one direction.
bool AreAlike(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

// A direction seen through a camera of another focal length, its logarithm over that of the first.
UncertainDirection Refocus(const UncertainDirection& direction, double log_focal);

// Whether a direction can lie in the plane with a normal; never beyond `max_deg`.
bool InPlane(const UncertainDirection& direction, const UncertainDirection& normal, double max_deg);

// What all directions of a photo have in common: the camera that they are seen through. Standard
// deviations.
struct CameraError {
  double middle_rad = 0.0;  // Each coordinate of the principal point over the focal length.
  double log_focal = 0.0;
};

// Two directions that may be at right angles, as houses are made, or at any angle.
class RightAngle {
 public:
  RightAngle(const UncertainDirection& a, const UncertainDirection& b,
             const CameraError& camera = CameraError());
  // Logarithm of the odds that they are.
  double LogOdds() const { return log_peak_ - 0.5 * angle_ * angle_ / variance_; }

 private:
  double angle_, variance_;  // From 90 degrees; radians.
  double log_peak_;
};

// Whether two directions of a lattice are those of rows and columns, within 4 degrees.
bool Rectangular(const UncertainDirection& a, const UncertainDirection& b);

// Normal of the plane that two directions span. False where they are within 15 degrees of parallel.
bool SpannedNormal(const UncertainDirection& a, const UncertainDirection& b,
                   UncertainDirection* normal);

// How precisely a direction is known, as a share of what it would be known to without any error of
// measurement: two fronts' short edges that pass for parallel make a long pencil, and a vague one.
double PrecisionShare(const UncertainDirection& direction);

// How much likelier it is to measure `normal` where a plane has the normal `plane`, but for what no
// covariance knows, than where planes lie any way.
double LikelihoodRatio(const UncertainDirection& normal, const Eigen::Vector3d& plane);

// Area of a standard deviation's ellipse about a direction, over that of a hemisphere.
double ShareOfHemisphere(const UncertainDirection& direction);

// Logarithm of the odds that some of the features have something in common to that none have, from
// the likelihood ratios of all: any share of them is as likely before.
double LogOddsOfMixture(const std::vector<double>& ratios);

// What a circle says of a plane: its conic C meets the plane's circular points, I^T C I = 0 for
// I = u + iv, where u and v span the plane. These two equations are linear in the conic, so that
// what is Gaussian there is Gaussian here, where the normals of a small or nearly frontal circle
// are not; and both planes that it can lie in fulfil them.
struct CircleEquations {
  Eigen::Vector2d value;
  Eigen::Matrix2d by_normal;   // Derivatives by the normal's steps along the columns of `basis`.
  Eigen::Matrix2d covariance;  // Of `value`: the conic's, and what no covariance knows.
  Eigen::Matrix<double, 3, 2> basis;

  CircleEquations(const ConicFit& fit, const Eigen::Vector3d& normal);
  // Squared distance from a plane whose normal is known so well, in standard deviations.
  double Chi2(const UncertainDirection& normal) const;
};

// Whether a circle can lie in the plane with a normal.
bool CanLieIn(const ConicFit& fit, const UncertainDirection& normal);

// The normal near `about` of the plane that circles lie in, which have it within `sigma_deg`.
UncertainDirection NormalOfCircles(const UncertainDirection& about, double sigma_deg,
                                   const std::vector<const ConicFit*>& circles);

// The normals of the planes that a circle can lie in, with covariances of the conic's own
// (CirclePlanes). Returns how many: 0, 1 or 2.
int CircleNormals(const ConicFit& fit, std::array<UncertainDirection, 2>* normals);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_STRUCTURE_UNCERTAIN_DIRECTION_H_
