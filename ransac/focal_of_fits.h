// The first step of FitObservations where the focal length is a guess and the lens bends: through a
// wrong one circles are no ellipses and lines are not straight, and points would be left out.
#ifndef CIRCLINE_RANSAC_FOCAL_OF_FITS_H_
#define CIRCLINE_RANSAC_FOCAL_OF_FITS_H_

#include <functional>

#include "circline/estimators/camera.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/observations.h"

namespace circline {

// Whether what the photo shows is curved otherwise at another focal length that may be: not where
// it is known, the lens is straight, or open (then it is what it bends that is known).
bool FocalBendsCurves(const Camera& camera, const CameraSigma& sigma);

// Sets the camera's focal length, pixels, to the one at which the fits that `fit_points` fills, of
// circles and lines, explain most points best, where that is clearly another, and `stated_focal_px`
// to the one given. No fit of `observations` is touched.
void TakeFocalOfFits(const CameraSigma& sigma, const std::function<void(Observations*)>& fit_points,
                     Observations* observations);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_FOCAL_OF_FITS_H_
