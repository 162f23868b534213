// The propositions as registered solvers: they choose the evidence, call the free functions of
// circle_pose.h and line_pose.h, settle the signs, rank, and propagate the covariance.
#ifndef CIRCLINE_ESTIMATORS_CLOSED_FORM_SOLVERS_H_
#define CIRCLINE_ESTIMATORS_CLOSED_FORM_SOLVERS_H_

#include "circline/estimators/export.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/solver_registry.h"

namespace CIRCLINE_EXPORT circline {

// What the registered closed forms take for noise.
struct ClosedFormOptions {
  // Standard deviation of a point where a feature states none, pixels; > 0.
  double sigma_px = 1.0;
  // Beside the noise of points. Its part of the covariance of fits that are already there is in
  // them (FitOptions::noise_model); a circle's height and k1 are left out.
  NoiseModel noise_model;
  // Ok, or a sentence that names the field which is wrong.
  Status Validate() const;
};

// orthogonal_vanishing_points  prop. 1   two pencils along two of the axes
// line_pairs                   prop. 5   any two pencils, orthogonal or not, coplanar or not
// single_circle                          a circle alone: both poses
// circle_center                prop. 3   a circle and the image of its centre
// circle_diameters             prop. 3   a circle and two or more chords through its centre
// concentric_circles           prop. 3   two or more circles about one centre
// parallel_circles             prop. 3   two or more circles of one plane
// circle_frame                 prop. 4   a circle and the images of the X and Y axes
//
// Hypotheses carry a covariance by statistical linearisation: each independent error of the fits
// and of the noise model, one standard deviation up and down (or as much of it as leads to a pose),
// through the closed form itself. Senses of axes that nothing decides follow the conventions of
// WorldRotation.
void AddClosedFormSolvers(SolverRegistry* registry, const ClosedFormOptions& options = {});

// Rotation of the world frame whose plane has the unit normal +-`normal`: the in-plane angle from
// the axes or from lines along them, else X towards the camera's right; the senses of the axes as
// drawn, else +Z towards the camera, then X to the right. `plane_ray`: any ray that meets the plane
// in front of the camera. `observations` fitted and resolved (ResolveWorld). False where the
// evidence is degenerate.
bool WorldRotation(const Observations& observations, const Eigen::Vector3d& normal,
                   const Eigen::Vector3d& plane_ray, double sigma_px, Eigen::Matrix3d* rotation);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_CLOSED_FORM_SOLVERS_H_
