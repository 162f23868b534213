// The scene file of a calibration: as given, with the estimated cameras.
#ifndef CIRCLINE_APPS_CALIBRATE_CALIBRATED_SCENE_H_
#define CIRCLINE_APPS_CALIBRATE_CALIBRATED_SCENE_H_

#include <string>
#include <vector>

#include "apps/common/scene.h"
#include "circline/estimators/status.h"
#include "circline/refine/adjust_photos.h"

namespace circline::apps {

// `source`: the scene file that the images come from; empty: there was none. Photos are named
// with their whole path, cameras state how well they are known.
Status WriteCalibratedScene(const std::string& source, const AdjustedPhotos& adjusted,
                            const std::vector<SceneImage>& images, const std::string& path);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_CALIBRATE_CALIBRATED_SCENE_H_
