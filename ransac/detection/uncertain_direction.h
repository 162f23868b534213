// Directions and normals with covariances, and what can be told from them: one plane or two, in the
// plane or not, at right angles or not. Each is a test with the propagated covariances, and with
// what no covariance of edge points knows.
#ifndef CIRCLINE_RANSAC_DETECTION_UNCERTAIN_DIRECTION_H_
#define CIRCLINE_RANSAC_DETECTION_UNCERTAIN_DIRECTION_H_

#include <Eigen/Core>
#include <array>
#include <vector>

#include "circline/estimators/conic_fit.h"

namespace circline {

// The walls of most houses are at right angles, to about so much (each pair, standard deviation).
constexpr double kRightAngleSigmaDeg = 0.7;

// A unit vector (a normal, or a pencil's direction), its sense without meaning, and its covariance,
// rank 2, rad^2.
struct UncertainDirection {
  Eigen::Vector3d vector = Eigen::Vector3d::Zero();
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
};

// The angle between two.
double AngleBetweenDeg(const UncertainDirection& a, const UncertainDirection& b);

// Whether two normals can be one plane's; never beyond `max_deg`.
bool SamePlane(const UncertainDirection& a, const UncertainDirection& b, double max_deg);

// Whether a direction can lie in the plane with a normal; never beyond `max_deg`.
bool InPlane(const UncertainDirection& direction, const UncertainDirection& normal, double max_deg);

// Logarithm of the odds that two directions are at right angles, as houses are made, to any angle.
double LogOddsOfRightAngle(const UncertainDirection& a, const UncertainDirection& b);

// Whether two directions of a lattice are those of rows and columns, within 4 degrees.
bool Rectangular(const UncertainDirection& a, const UncertainDirection& b);

// Normal of the plane that two directions span. False where they are within 15 degrees of parallel.
bool SpannedNormal(const UncertainDirection& a, const UncertainDirection& b,
                   UncertainDirection* normal);

// The mean of directions near `about`, weighted by their accuracy.
UncertainDirection MeanDirection(const UncertainDirection& about,
                                 const std::vector<const UncertainDirection*>& directions);

// How much likelier it is to measure `normal` where a plane has the normal `plane`, but for what no
// covariance knows, than where planes lie any way.
double LikelihoodRatio(const UncertainDirection& normal, const Eigen::Vector3d& plane);

// Area of a standard deviation's ellipse about a direction, over that of a hemisphere.
double ShareOfHemisphere(const UncertainDirection& direction);

// Logarithm of the odds that some of the features have something in common to that none have, from
// the likelihood ratios of all: any share of them is as likely before.
double LogOddsOfMixture(const std::vector<double>& ratios);

// The normals of the planes that a circle can lie in, with covariances: those of the conic's own
// covariance, by differences. Returns how many: 0, 1 or 2.
int CircleNormals(const ConicFit& fit, std::array<UncertainDirection, 2>* normals);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_UNCERTAIN_DIRECTION_H_
