// The photo with what was found in it, and the pose that came of it.
#ifndef CIRCLINE_APPS_COMPARE_OVERLAY_H_
#define CIRCLINE_APPS_COMPARE_OVERLAY_H_

#include <opencv2/core.hpp>
#include <string>

#include "apps/compare/image_run.h"

namespace circline::apps {

// Inlier points and fitted ellipses, circle centres, pencils in colours, the plane's grid and
// vanishing line, the world axes, a caption below. As large as the photo. Curves are drawn through
// the lens: a circle lies on its rim even where distortion bends it.
cv::Mat DrawOverlay(const ImageRun& run);

// Draws it into overlays/ of a folder and adds the time to the run's stages, where there is a
// photo. `file`: its name in the folder, empty where there is none; `picture` (may be null): the
// same.
Status WriteOverlay(const std::string& folder, ImageRun* run, std::string* file,
                    cv::Mat* picture = nullptr);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_OVERLAY_H_
