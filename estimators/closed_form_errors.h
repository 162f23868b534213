// How errors of its inputs go through a closed form. Internal: not installed.
#ifndef CIRCLINE_ESTIMATORS_CLOSED_FORM_ERRORS_H_
#define CIRCLINE_ESTIMATORS_CLOSED_FORM_ERRORS_H_

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <vector>

#include "circline/estimators/closed_form_recipes.h"
#include "circline/estimators/noise_model.h"

namespace circline {

// One independent error: moves the inputs by `part` of its standard deviation.
using Perturbation = std::function<void(double part, const std::vector<MovedInput>& inputs)>;

// Adds what of the noise model is private to one input: a pencil against its axis, a circle against
// its plane, a radius or length that states no sigma.
void AddModelErrors(const NoiseModel& noise, Inputs* inputs);

// The errors of the inputs, and those that the noise model has for all of them at once: the
// camera's, by the affine change of calibrated coordinates (k1 has none), and the offsets of
// contours.
std::vector<Perturbation> Perturbations(const std::vector<MovedInput>& inputs,
                                        const NoiseModel& noise, const Camera& camera);

// All candidates with one error, by its index, at `part` of its standard deviation.
using PerturbedCandidates = std::function<std::vector<Candidate>(std::size_t error, double part)>;

// Statistical linearisation: every error, one standard deviation up and down, through the closed
// form itself; a part of that where it would lead to no pose (beyond the ellipses). Returns for
// each candidate columns of [delta, delta_t, contradiction].
std::vector<Eigen::MatrixXd> Sensitivities(const PerturbedCandidates& perturbed,
                                           std::size_t num_errors,
                                           const std::vector<Candidate>& candidates);

// A candidate as a hypothesis without uncertainty; where `spin_is_free` the turn about the plane's
// normal is a free direction.
PoseHypothesis UncertainPose(const Candidate& candidate, bool metric, bool spin_is_free);

// Covariance, rank and cost, of the candidate's sensitivity `S`.
void FillUncertainty(const Eigen::MatrixXd& S, const Candidate& candidate, PoseHypothesis* h);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_CLOSED_FORM_ERRORS_H_
