// Names of features that go on from photo to photo. Internal: not installed.
#ifndef CIRCLINE_RANSAC_DETECTION_KEEP_NAMES_H_
#define CIRCLINE_RANSAC_DETECTION_KEEP_NAMES_H_

#include "circline/estimators/observations.h"
#include "circline/ransac/detection/feature_follower.h"

namespace circline {

// Names what was detected cold after the predicted features that it continues, and the rest anew:
// circles whose centre lies within `search_px`, or within half of their own semi-minor axis, of the
// predicted one and that are as large to a factor of 1.5; pencils that share half of their lines.
// What goes on keeps its plane, role and radius, and comes first, in the order of the prediction.
// Nothing goes on where fewer than half of the circles and pencils would. Returns how many do.
int KeepNames(const Observations& predicted, double search_px, NextNames* next,
              Observations* detected);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_KEEP_NAMES_H_
