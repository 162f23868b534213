// Imaged circular points (ICPs): where every circle of a plane, seen by a calibrated camera, meets
// the image of the absolute conic x^2 + y^2 + z^2 = 0. With them go the projective forms of the
// propositions of Wang, Wu and Ji 2007: "orthogonal" becomes "harmonic", a cross ratio of -1.
//
// All in calibrated coordinates, homogeneous 3-vectors; nothing allocates or iterates.
#ifndef CIRCLINE_ESTIMATORS_CIRCULAR_POINTS_H_
#define CIRCLINE_ESTIMATORS_CIRCULAR_POINTS_H_

#include <Eigen/Core>
#include <array>

#include "circline/estimators/export.h"

namespace CIRCLINE_EXPORT circline {

// The conjugate pair real +- i imag. Any complex multiple is the same point; of all multiples, real
// and imag are orthogonal and of equal length.
struct CircularPoints {
  Eigen::Vector3d real = Eigen::Vector3d::Zero();  // Calibrated, homogeneous.
  Eigen::Vector3d imag = Eigen::Vector3d::Zero();  // Likewise.
};

// ICPs of the planes with the given normal (any length, either sign): real, imag and the normal are
// a right-handed orthogonal frame. False for a zero or non-finite normal. 10 ns.
bool CircularPointsOfPlane(const Eigen::Vector3d& normal, CircularPoints* points);

// ICPs of the planes on which an ellipse can be the image of a circle: its four intersections with
// the image of the absolute conic, in conjugate pairs; proposition 3 before the centre decides.
// Returns how many pairs were written, as CirclePoses does: 2; 1 where the pairs coincide; 0 where
// the conic is no ellipse. 0.15 us.
int CircularPointsOfConic(const Eigen::Matrix3d& conic, std::array<CircularPoints, 2>* points);

// The join of the pair: the vanishing line of their plane, which is its unit normal, with the sign
// of real x imag. False where the two are not a conjugate pair of distinct points (real and imag
// parallel to rounding, or not finite).
bool VanishingLine(const CircularPoints& points, Eigen::Vector3d* line);

// The point of the line that with v divides the ICPs harmonically: the vanishing point orthogonal
// to v in the plane, v turned by +90 degrees about real x imag, of v's length.
bool HarmonicConjugate(const CircularPoints& points, const Eigen::Vector3d& v,
                       Eigen::Vector3d* conjugate);

// Proposition 2: R from the ICPs and the image of the X axis or of a line parallel to it (a line of
// the image, 3-vector). r3 is the vanishing line, r1 where the axis meets it; signs as they come:
// see SignChoices. False where the line is the vanishing line itself. 50 ns.
bool RotationFromCircularPoints(const CircularPoints& points, const Eigen::Vector3d& x_line,
                                Eigen::Matrix3d* rotation);

// Proposition 4, the test: the cosine of the angle between the axes with images x_line and y_line
// (or of lines parallel to them) in the plane. The cross ratio of the ICPs and the two points where
// the lines meet the vanishing line is exp(2 i angle) (Laguerre 1853): it is -1, and the cosine 0,
// for the true plane. Infinity where a line is the vanishing line.
double HarmonicDeviation(const CircularPoints& points, const Eigen::Vector3d& x_line,
                         const Eigen::Vector3d& y_line);

// Proposition 4: a circle and the images of the two axes of its plane's frame (or of lines parallel
// to them). For each candidate plane the rotation whose X and Y axes are nearest to where x_line
// and y_line meet the vanishing line. Signs as they come: see SignChoices.
struct FrameRotation {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  // World to camera.
  double deviation = 0.0;  // |HarmonicDeviation| of the axes: 0 for the true plane.
};
// On one plane, given by its ICPs: what the solver `circle_frame` runs for each candidate. What the
// axes lack to a right angle is shared between them in proportion to the variances of their
// directions in the plane (rad^2); equal ones, as in the paper, turn both by the same angle. False
// where a line is the vanishing line, or where the axes are parallel.
bool RotationFromFrame(const CircularPoints& points, const Eigen::Vector3d& x_line,
                       double x_variance, const Eigen::Vector3d& y_line, double y_variance,
                       FrameRotation* rotation);
// On both planes of an ellipse, with equal variances. Returns how many were written, the smaller
// deviation first: at most 2, as CircularPointsOfConic. 0.3 us.
int RotationsFromCircleAndFrame(const Eigen::Matrix3d& conic, const Eigen::Vector3d& x_line,
                                const Eigen::Vector3d& y_line,
                                std::array<FrameRotation, 2>* rotations);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_CIRCULAR_POINTS_H_
