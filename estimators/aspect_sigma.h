// How well a camera is known, by whether its pixels are square. Internal: not installed, but shown
// to circline_refine.
#ifndef CIRCLINE_ESTIMATORS_ASPECT_SIGMA_H_
#define CIRCLINE_ESTIMATORS_ASPECT_SIGMA_H_

#include "circline/estimators/camera.h"
#include "circline/estimators/export.h"
#include "circline/estimators/noise_model.h"

namespace CIRCLINE_EXPORT circline {

// `sigma`, what is said of cameras in general, as it holds for this one. Pixels that a calibration
// found not to be square are those of analogue video, sampled and smeared along its lines, or the
// calibration is off by as much: the aspect is known to |log (fy / fx)|, at most 2 % (photos may be
// squeezed on purpose), if to no less than log_aspect; where that is 0 it is exact.
CameraSigma SigmaOf(const CameraSigma& sigma, const Camera& camera);

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_ASPECT_SIGMA_H_
