// How errors of its inputs go through a closed form. Internal: not installed.
#ifndef CIRCLINE_ESTIMATORS_CLOSED_FORM_ERRORS_H_
#define CIRCLINE_ESTIMATORS_CLOSED_FORM_ERRORS_H_

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "circline/estimators/closed_form_recipes.h"
#include "circline/estimators/noise_model.h"

namespace circline {

// One independent error: moves the inputs by `part` of its standard deviation.
using Perturbation = std::function<void(double part, Inputs* inputs)>;

// Adds what of the noise model is private to one input: a pencil against its axis, a circle against
// its plane, a radius or length that states no sigma.
void AddModelErrors(const NoiseModel& noise, Inputs* inputs);

// The errors of the inputs, and those that the noise model has for all of them at once: the
// camera's, by the affine change of calibrated coordinates (k1 has none), and the offsets of
// contours.
std::vector<Perturbation> Perturbations(const Inputs& inputs, const NoiseModel& noise,
                                        const Camera& camera);

// Statistical linearisation: every perturbation, one standard deviation up and down, through the
// closed form itself; a part of that where it would lead to no pose (beyond the ellipses). Returns
// for each candidate columns of [delta, delta_t, contradiction].
std::vector<Eigen::MatrixXd> Sensitivities(const Evaluate& evaluate, const Inputs& inputs,
                                           const std::vector<Perturbation>& perturbations,
                                           const std::vector<Candidate>& candidates);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_CLOSED_FORM_ERRORS_H_
