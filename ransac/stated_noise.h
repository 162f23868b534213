// Whether the noise that a feature states can be that of its points. Internal: not installed.
#ifndef CIRCLINE_RANSAC_STATED_NOISE_H_
#define CIRCLINE_RANSAC_STATED_NOISE_H_

#include <string>

#include "circline/estimators/camera.h"
#include "circline/estimators/observations.h"
#include "circline/ransac/fit_observations.h"

namespace circline {

// In words, where a third or more of the points of a fitted feature that states its noise are
// outliers, most of which would be none at a far larger noise; else empty. Of a pencil: of
// its lines' points about each line; segments of two points, which miss a direction, may be odd.
std::string StatedNoiseProblem(const FitOptions& options, const Camera& camera,
                               const CircleObservation& circle);
std::string StatedNoiseProblem(const FitOptions& options, const Camera& camera,
                               const PencilObservation& pencil);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_STATED_NOISE_H_
