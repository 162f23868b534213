// The photo with a box drawn on it.
#ifndef CIRCLINE_APPS_RECONSTRUCT_BOX_PICTURE_H_
#define CIRCLINE_APPS_RECONSTRUCT_BOX_PICTURE_H_

#include <opencv2/core.hpp>

#include "apps/reconstruct/fit_box.h"

namespace circline::apps {

// Its edges as fitted, x red, y green, z blue, those behind it dashed; the points that they were
// fitted to; along each axis its length, with the standard deviation. BGR, as large as the photo.
cv::Mat DrawBox(const cv::Mat& photo, const BoxObservation& box, const BoxFit& fit);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_BOX_PICTURE_H_
