// Circles of a photo that are known from the one before. Internal: not installed.
#ifndef CIRCLINE_RANSAC_DETECTION_FOLLOW_CIRCLES_H_
#define CIRCLINE_RANSAC_DETECTION_FOLLOW_CIRCLES_H_

#include <vector>

#include "circline/estimators/observations.h"
#include "circline/ransac/detection/detect_ellipses.h"

namespace circline {

// No circle changes its size by more than this factor from a frame to the next.
constexpr double kMaxGrowth = 1.5;

// For each predicted circle the ellipse that the edges follow within `search_px` of it, by the same
// fit and the same verdict as DetectEllipses; without points where there is none. A predicted
// circle has a fit, and a few points with normals if its bright side is known.
std::vector<DetectedEllipse> FollowCircles(const EdgeMap& edges, const Camera& camera,
                                           const std::vector<CircleObservation>& predicted,
                                           const EllipseOptions& options, double search_px);

// Gives a circle what is known of the predicted one that it continues, whatever the photo.
void Continue(const CircleObservation& predicted, CircleObservation* circle);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_FOLLOW_CIRCLES_H_
