// What a front end writes: it has the rim of a manhole cover, 0.6 m across, and the edges of two
// kerbs, and wants the pose of its camera over the road, metric, with a covariance. README.md shows
// this file; the package test builds it.
#include <cstdio>
#include <utility>
#include <vector>

#include "circline/ransac/fit_observations.h"
#include "circline/refine/estimate_pose.h"

using namespace circline;

bool PoseOverRoad(const Camera& camera, const std::vector<Eigen::Vector2d>& rim,
                  const std::vector<Segment>& kerbs, CameraPose* pose, Matrix6d* covariance) {
  Observations observations;
  observations.camera = camera;

  CircleObservation cover;
  cover.id = "cover";
  cover.plane = "road";
  cover.points = rim;  // Pixels of the photo as taken; outliers welcome.
  cover.radius = 0.3;  // Metres: makes the translation metric.
  observations.circles.push_back(std::move(cover));

  PencilObservation along;
  along.id = "kerbs";
  along.plane = "road";
  along.direction = PencilDirection::kX;  // The world's X axis runs along the kerbs.
  for (const Segment& kerb : kerbs) along.lines.push_back({{kerb[0], kerb[1]}, {}, {}});
  observations.pencils.push_back(std::move(along));

  const Status fitted =
      FitObservations(FitOptions(), &observations);          // RANSAC: masks, conics, lines.
  const PoseEstimate estimate = EstimatePose(observations);  // Closed forms, then Ceres.
  if (!fitted.ok() || !estimate.status.ok()) {
    std::fprintf(stderr, "%s %s\n", fitted.message.c_str(), estimate.status.message.c_str());
    return false;
  }
  const PoseHypothesis& best = estimate.hypotheses.front();  // Ranked; ambiguity is in the others.
  *pose = best.cam_from_world;
  *covariance = best.Covariance();  // Of [rotation (camera frame, rad), translation].
  return best.probability > 0.95;
}
