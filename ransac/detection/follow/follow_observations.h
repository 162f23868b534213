// The steps of FeatureFollower (those of follow_circles.cc, follow_lines.cc, move_observations.cc
// and keep_names.cc, too). Internal: not installed.
#ifndef CIRCLINE_RANSAC_DETECTION_FOLLOW_FOLLOW_OBSERVATIONS_H_
#define CIRCLINE_RANSAC_DETECTION_FOLLOW_FOLLOW_OBSERVATIONS_H_

#include <cstddef>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/status.h"
#include "circline/ransac/detection/ellipses/detect_ellipses.h"
#include "circline/ransac/detection/feature_follower.h"
#include "circline/ransac/detection/lines/detect_lines.h"

namespace circline {

// No circle changes its size by more than this factor from a frame to the next.
constexpr double kMaxGrowth = 1.5;

// For each predicted circle the ellipse that the edges follow within `search_px` of it, by the same
// fit and the same verdict as DetectEllipses; without points where there is none. A predicted
// circle has a fit, and a few points with normals if its bright side is known.
std::vector<DetectedEllipse> FollowCircles(const EdgeMap& edges, const Camera& camera,
                                           const std::vector<CircleObservation>& predicted,
                                           const EllipseOptions& options, double search_px);

// Gives a feature what is known of the predicted one that it continues, whatever the photo.
void Continue(const CircleObservation& predicted, CircleObservation* circle);
void Continue(const PencilObservation& predicted, PencilObservation* pencil);

// What may be one feature in two photos.
struct FeaturePair {
  double cost;
  std::size_t first, second;
};

// For each of the first features the second one that it is, or -1: the cheapest pairs first, each
// feature once.
std::vector<int> CheapestPairs(std::vector<FeaturePair> pairs, std::size_t num_first,
                               std::size_t num_second);

// For each predicted pencil the detected lines that continue its own, none in two pencils: within
// `search_px` at both ends, over half of the shorter one. -1 for a line that none continues.
std::vector<std::vector<int>> MatchLines(const std::vector<PencilObservation>& predicted,
                                         const std::vector<DetectedLine>& lines, double search_px);

// A pencil of the lines found for it: fits, noise and outliers as those of the cold detector. Empty
// where none were found.
PencilObservation FollowPencil(const PencilObservation& predicted,
                               const std::vector<DetectedLine>& lines,
                               const std::vector<int>& matches, double diagonal_px);

// Whether the points of a pencil's lines are the centres of circles (see circle_grid.h).
bool IsOfCentres(const Observations& predicted, const PencilObservation& pencil);

// Whether a circle or pencil lies in the plane.
bool HasPlane(const Observations& observations, const std::string& plane);

// Circles and lines of edges.
int CountFeatures(const Observations& observations);

// Those of the predicted features that are found within `search_px`, with the ids, planes and roles
// of the prediction; and what to `expect` from here: the same, and what was not found where it was
// predicted. Not ok as DetectObservations.
Status FollowObservations(const cv::Mat& image, const Observations& predicted, double search_px,
                          const DetectionOptions& options, Observations* found,
                          Observations* expect);

// The features as a camera at `next` sees them; see FeatureFollower::Move. Of contours and lines
// only a few points are kept: fits and directions tell the rest.
Observations MoveObservations(const Observations& observations, const PoseHypothesis& last,
                              const CameraPose& next);

// Names what was detected cold after the predicted features that it continues, and the rest anew:
// circles whose centre lies within `search_px`, or within half of their own semi-minor axis, of the
// predicted one and that are as large to a factor of 1.5; pencils that share half of their lines.
// What goes on keeps its plane, role and radius, and comes first, in the order of what was held.
// Nothing goes on where fewer than half of the circles and pencils would. Returns how many do.
// Planes and roles are those of the detection where the world has had no circles in its plane yet,
// and another plane has some.
int KeepNames(const Observations& held, double search_px, NextNames* next, Observations* detected);

}  // namespace circline

#endif  // CIRCLINE_RANSAC_DETECTION_FOLLOW_FOLLOW_OBSERVATIONS_H_
