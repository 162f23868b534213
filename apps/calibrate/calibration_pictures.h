// Photos of a calibration, with what was found in them.
#ifndef CIRCLINE_APPS_CALIBRATE_CALIBRATION_PICTURES_H_
#define CIRCLINE_APPS_CALIBRATE_CALIBRATION_PICTURES_H_

#include <string>
#include <vector>

#include "apps/common/scene.h"
#include "apps/compare/options.h"
#include "circline/refine/adjust_photos.h"

namespace circline::apps {

// JPEG, by photo: those left out and as many others as a page bears, seen anew through the camera
// that was estimated; empty for the others, and where there is nothing to look at. `images`: of
// the photos.
std::vector<std::string> CalibrationPictures(const CompareOptions& options,
                                             const AdjustedPhotos& adjusted,
                                             const std::vector<SceneImage>& images);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_CALIBRATE_CALIBRATION_PICTURES_H_
