// The first step of FitObservations where the focal length or the lens is a guess: through a wrong
// camera that bends circles are no ellipses and lines are not straight, and points would be left
// out.
#ifndef CIRCLINE_RANSAC_CAMERA_OF_FITS_H_
#define CIRCLINE_RANSAC_CAMERA_OF_FITS_H_

#include <functional>

#include "circline/estimators/camera.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/observations.h"

namespace circline {

// Fills the fits of circles and lines, at the camera of the observations.
using FitPointsFn = std::function<void(Observations*)>;

// Where what the photo shows is curved otherwise at another focal length that may be: sets the
// camera's to the one, pixels, at which the fits that `fit_points` fills explain most points best,
// where that is clearly another, and `stated_focal_px` to the one given. Not where it is known, was
// looked for before, the lens is straight, or open (then it is what it bends that is known). No fit
// of `observations` is touched.
void TakeFocalOfFits(const CameraSigma& sigma, const FitPointsFn& fit_points,
                     Observations* observations);

// The same for the camera's k1, where CameraSigma says that it may be another; `found_k1` is what
// it has beyond the one given.
void TakeLensOfFits(const CameraSigma& sigma, const FitPointsFn& fit_points,
                    Observations* observations);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_CAMERA_OF_FITS_H_
