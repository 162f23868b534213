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

// A candidate as a hypothesis without covariance; where `spin_is_free` the turn about the plane's
// normal is a free direction.
PoseHypothesis WithoutUncertainty(const Candidate& candidate, bool metric, bool spin_is_free);

// All candidates as hypotheses, with covariance, rank and cost from what each error does to them.
std::vector<PoseHypothesis> WithUncertainty(const std::vector<Candidate>& candidates,
                                            const PerturbedCandidates& perturbed,
                                            std::size_t num_errors, bool metric, bool spin_is_free);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_CLOSED_FORM_ERRORS_H_
