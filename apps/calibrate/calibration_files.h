// What a calibration leaves behind, for people and for other programs.
#ifndef CIRCLINE_APPS_CALIBRATE_CALIBRATION_FILES_H_
#define CIRCLINE_APPS_CALIBRATE_CALIBRATION_FILES_H_

#include <string>
#include <vector>

#include "apps/common/scene.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/status.h"
#include "circline/refine/adjust_photos.h"

namespace circline::apps {

// calibration.yml (one more for each further camera, after its id), calibration.json, cameras.txt
// and images.txt, report.html in `folder`. `names`: of the photos; `pictures`: of them, JPEG, may
// be empty. `note`: what the files could not take, a line; or empty.
Status WriteCalibration(const AdjustedPhotos& adjusted, const std::vector<Observations>& photos,
                        const std::vector<std::string>& names,
                        const std::vector<std::string>& pictures, const std::string& folder,
                        std::string* note);

// Removes what an earlier run wrote into that folder and this one may not write over: the files of
// its further cameras, and those of --import.
void RemoveEarlierCalibration(const std::string& folder);

// The scene file with the estimated cameras, which state how well they are known. `source`: the
// scene file that the images come from; empty: there was none. Photos are named with their whole
// path.
Status WriteCalibratedScene(const std::string& source, const AdjustedPhotos& adjusted,
                            const std::vector<SceneImage>& images, const std::string& path);

// Why a photo is left out, the other one by its name where it shows nearly the same.
std::string WhyLeftOut(const AdjustedPhoto& photo, const std::vector<std::string>& names);

// The same for the eye.
std::string CalibrationTable(const AdjustedPhotos& adjusted, const std::vector<std::string>& names);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_CALIBRATE_CALIBRATION_FILES_H_
