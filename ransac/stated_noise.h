// Whether the noise that a circle states can be that of its points. Internal: not installed.
#ifndef CIRCLINE_RANSAC_STATED_NOISE_H_
#define CIRCLINE_RANSAC_STATED_NOISE_H_

#include <string>

#include "circline/estimators/camera.h"
#include "circline/estimators/observations.h"
#include "circline/ransac/fit_observations.h"

namespace circline {

// In words, where most points of a circle that states its noise are outliers or it has no fit, that
// an ellipse passes through far more of them at a far larger noise; else empty.
std::string StatedNoiseProblem(const FitOptions& options, const Camera& camera,
                               const CircleObservation& circle);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_STATED_NOISE_H_
