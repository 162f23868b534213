// Pictures: a box drawn on its photo; the photo and the model from three sides.
#ifndef CIRCLINE_APPS_RECONSTRUCT_VIEWS_H_
#define CIRCLINE_APPS_RECONSTRUCT_VIEWS_H_

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "apps/reconstruct/fit_box.h"
#include "apps/reconstruct/model.h"
#include "circline/estimators/pose.h"

namespace circline::apps {

// The edges of a box as fitted, x red, y green, z blue, those behind it dashed; the points that
// they were fitted to; along each axis its length, with the standard deviation. BGR, as large as
// the photo.
cv::Mat DrawBox(const cv::Mat& photo, const BoxObservation& box, const BoxFit& fit);

// Four pictures of one size, at most 1600 pixels along the longer side: `photo` (BGR), then the
// model from the left of where the photo was taken, from the right, and from above, with `caption`
// below.
cv::Mat ModelViews(const cv::Mat& photo, const Model& model, const CameraPose& pose,
                   const std::string& title, const std::vector<std::string>& caption);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_VIEWS_H_
