// The photo with what was found in it, and the pose that came of it.
#ifndef CIRCLINE_APPS_COMPARE_OVERLAY_H_
#define CIRCLINE_APPS_COMPARE_OVERLAY_H_

#include <cstdint>
#include <opencv2/core.hpp>
#include <vector>

#include "apps/compare/image_run.h"

namespace circline::apps {

// Inlier points and fitted ellipses, circle centres, pencils in colours, the plane's grid and
// vanishing line, the world axes, a caption. Curves are drawn through the lens: a circle lies on
// its rim even where distortion bends it. Small photos are enlarged so that the lettering is
// legible.
cv::Mat DrawOverlay(const ImageRun& run);

std::vector<std::uint8_t> EncodePng(const cv::Mat& picture);
// At most `max_width` pixels wide.
std::vector<std::uint8_t> EncodeJpeg(const cv::Mat& picture, int max_width);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_OVERLAY_H_
