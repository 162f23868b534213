// The steps of a tracker beside a frame's own. Internal: not installed.
#ifndef CIRCLINE_REFINE_TRACK_TRACK_STEPS_H_
#define CIRCLINE_REFINE_TRACK_TRACK_STEPS_H_

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "circline/estimators/camera.h"
#include "circline/estimators/noise_model.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/refine/pose_tracker.h"
#include "circline/refine/track/scratch.h"
#include "circline/refine/track/track_frame.h"
#include "circline/refine/track/track_state.h"

namespace circline {

// --- frame_news.cc: how much a frame says that the one before has not said. ---

// The errors that points of a contour or line share (NoiseModel) stay where the image stays: a
// camera at rest takes one photo, however often. Over frames in which a feature moves by d pixels
// across itself they are autoregressive, of coefficient r = exp(-d^2 / 2): n frames are worth n (1
// - r) / (1 + r). What else errs is new in every frame.
class FrameNews {
 public:
  // Of the next frame, fitted and with its noise: from 0, nothing, to 1, as much as a photo by
  // itself. The mean over its circles and lines; what the frame before does not have is all new.
  // Allocates nothing where there are no more features and points than before.
  double Next(const Observations& fitted, const NoiseModel& noise);

 private:
  struct Shape {
    std::string id;  // Of the circle, of the line's pencil.
    bool is_circle = false;
    Eigen::Matrix3d conic;
    Eigen::Vector3d line;

    double Distance2(const CalibratedPoint& p) const;  // Squared, pixels.
  };
  // What the shape that came last, of these points, says. `weight`: how much of its variance is new
  // in every frame (NoiseModel).
  double OfLast(double weight, const Camera& camera, const std::vector<Eigen::Vector2d>& points,
                const std::vector<std::uint8_t>& inliers);

  Kept<Shape> before_, now_;
  std::vector<CalibratedPoint> points_;
};

// --- track_map.cc: from a frame's features to a tracker's map. ---

// A map of the frame's circles and directions, and a wide Gaussian about each hypothesis with its
// probability. The first circle fixes origin and unit. `resolved`: fitted, with a world.
void StartMap(const Observations& resolved, const std::vector<PoseHypothesis>& hypotheses,
              const TrackerOptions& options, TrackMap* map, Kept<TrackFit>* states);

// Of turns, radians, and of lengths, distances of the origin, of which nothing is known yet.
constexpr double kUnknown = 1.0;

// A pose and velocities of which nothing is known but where to start: the pose's turn about the
// plane's normal as well as `normal_turn_sigma` says, radians.
void SetUnknownMotion(const TrackMap& map, const TrackerOptions& options, const CameraPose& pose,
                      double normal_turn_sigma, TrackState* state);

// Adds what the map does not have, where each hypothesis sees it, as not known yet.
void ExtendMap(const Observations& fitted, const TrackerOptions& options, TrackMap* map,
               Kept<TrackFit>* states);

// --- track_anew.cc: what a map lacks, and a later frame may tell. ---

// Whether a frame by itself, whose pose this is, tells the focal length so well that the frames to
// come can refine it. `sigma`: how well it is known besides.
bool TellsFocal(const PoseHypothesis& hypothesis, const CameraSigma& sigma);
// Whether the track does not know the focal length, positions or, any more, the pose.
bool LacksSomething(const TrackMap& map, const TrackState& state);
// Which of these a frame by itself, whose `own` pose this is, tells much better, in words for
// people. Empty: none.
std::string WhatIsTold(const PoseHypothesis& own, const TrackMap& map, const TrackState& state);
// How many features of a frame are not of the map.
int NumStrange(const Observations& frame, const TrackMap& map);

// --- track_relocate.cc: back to a known map after a loss. ---

// The states of a map where a single frame, of a world of its own, sees its circles: pose and
// velocities as not known, landmarks and camera as they are. Circles and directions are the same
// where their ids are. Empty where no circle of the map is seen.
std::vector<TrackState> Relocated(const TrackMap& map, const Kept<TrackFit>& states,
                                  const std::vector<PoseHypothesis>& seen,
                                  const TrackerOptions& options);

// --- track_ranking.cc: hypotheses against one another. ---

// Minima that several starts lead to are one, the most probable.
void Merge(const TrackMap& map, Kept<TrackFit>* fits);

// Log weights to log probabilities; drops what is improbable and orders the rest. The first stays
// first unless another one is clearly more probable.
void Rank(const TrackerOptions& options, Kept<TrackFit>* fits);

// --- track_result.cc: a tracked hypothesis as users see it. ---

// Pose, probability, covariance, free directions, circles and directions of the map, in the memory
// that the hypothesis has; nothing that a frame says of it.
void FillHypothesis(const TrackMap& map, const TrackState& state, const Camera& camera,
                    PoseHypothesis* hypothesis);

// PoseEstimate::decided_by, of ranked hypotheses.
void DecidedByFrames(const std::vector<PoseHypothesis>& hypotheses, std::string* decided_by);

// What a frame says of a hypothesis: inliers, cost, what was left out and in words why.
// `distances`: memory.
void FillFrame(const TrackFrame& frame, const TrackFit& fit, PoseHypothesis* hypothesis,
               std::vector<std::string>* notes, std::vector<double>* distances);

}  // namespace circline

#endif  // CIRCLINE_REFINE_TRACK_TRACK_STEPS_H_
