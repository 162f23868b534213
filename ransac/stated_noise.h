// Whether the noise that a feature states can be that of its points. Internal: not installed.
#ifndef CIRCLINE_RANSAC_STATED_NOISE_H_
#define CIRCLINE_RANSAC_STATED_NOISE_H_

#include <string>

#include "circline/estimators/observations.h"
#include "circline/ransac/fit_observations.h"

namespace circline {

// In words, where a third or more of the points of a fitted feature that states its noise are
// outliers, most of which would be none at a far larger noise; else empty. `feature`: a circle or a
// pencil alone, with its camera; of a pencil, its lines' points about each line count (segments of
// two points, which miss a direction, may be odd). `curve` names what they should lie on.
std::string StatedNoiseProblem(const FitOptions& options, const std::string& curve,
                               Observations feature);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_STATED_NOISE_H_
