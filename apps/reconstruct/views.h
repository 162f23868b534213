// A picture of the photo and of the model from three sides.
#ifndef CIRCLINE_APPS_RECONSTRUCT_VIEWS_H_
#define CIRCLINE_APPS_RECONSTRUCT_VIEWS_H_

#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "apps/reconstruct/model.h"
#include "circline/estimators/camera.h"
#include "circline/estimators/pose.h"

namespace circline::apps {

// The model as a pinhole camera sees it (BGR), on a light ground; what is transparent shows what is
// behind it. Surfaces seen from behind are grey.
cv::Mat RenderModel(const Model& model, const Camera& camera, const CameraPose& pose);

// Four pictures of one size, at most 1600 pixels along the longer side: `photo` (BGR), then the
// model from the left of where the photo was taken, from the right, and from above, with `caption`
// below.
cv::Mat ModelViews(const cv::Mat& photo, const Model& model, const CameraPose& pose,
                   const std::string& title, const std::vector<std::string>& caption);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_VIEWS_H_
