// The unknown focal length of one photo in closed form from one circle and its centre, or from two
// circles of a plane. Coordinates, units and refusals as in focal_length.h.
#ifndef CIRCLINE_ESTIMATORS_CIRCLE_FOCAL_H_
#define CIRCLINE_ESTIMATORS_CIRCLE_FOCAL_H_

#include <Eigen/Core>
#include <array>

#include "circline/estimators/conic_fit.h"
#include "circline/estimators/export.h"
#include "circline/estimators/focal_length.h"

namespace CIRCLINE_EXPORT circline {

// A circle and the image of its centre (homogeneous, with covariance): the vanishing line is its
// polar, C o (proposition 3). One solution. Refuses a frontal plane (the polar is at infinity) and
// a centre outside the ellipse. 2 us.
int FocalFromCircleAndCenter(const ConicFit& circle, const Eigen::Vector3d& center,
                             const Eigen::Matrix3d& center_covariance, FocalSolution* solution,
                             FocalRefusal* why = nullptr);

// Two circles with one centre: the simple eigenvector of C1^-1 C2 is its image; f^2 from both
// circles, weighted. One solution. Refuses a frontal plane and circles that coincide. 25 us.
int FocalFromConcentricCircles(const ConicFit& a, const ConicFit& b, FocalSolution* solution,
                               FocalRefusal* why = nullptr);

// Two circles of one plane, or of parallel planes, of any radii: the member C2 - l C1 of their
// pencil that is a pair of real lines holds the vanishing line and the radical axis. Of circles
// beside one another the axis runs between them, which tells it; of nested ones both lines are
// candidates: up to two solutions. Refuses concentric circles. 15 us.
int FocalFromCoplanarCircles(const ConicFit& a, const ConicFit& b,
                             std::array<FocalSolution, 2>* solutions, FocalRefusal* why = nullptr);

// The fit as one of several circles of a plane against which its own plane is tilted, about each of
// two axes, by an error of `tilt_sigma` radians: adds to the covariance the mean of what that does
// to both circles that the conic may be the image of.
ConicFit WithTiltError(const ConicFit& fit, double tilt_sigma);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_CIRCLE_FOCAL_H_
