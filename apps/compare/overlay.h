// The photo with what was found in it, and the pose that came of it.
#ifndef CIRCLINE_APPS_COMPARE_OVERLAY_H_
#define CIRCLINE_APPS_COMPARE_OVERLAY_H_

#include <opencv2/core.hpp>

#include "apps/compare/image_run.h"

namespace circline::apps {

// Inlier points and fitted ellipses, circle centres, pencils in colours, the plane's grid and
// vanishing line, the world axes, a caption below. As large as the photo. Curves are drawn through
// the lens: a circle lies on its rim even where distortion bends it.
cv::Mat DrawOverlay(const ImageRun& run);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_OVERLAY_H_
