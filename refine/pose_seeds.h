// Where refinements of one world plane may start. Internal: not installed.
#ifndef CIRCLINE_REFINE_POSE_SEEDS_H_
#define CIRCLINE_REFINE_POSE_SEEDS_H_

#include <memory>
#include <string>
#include <vector>

#include "circline/estimators/pose.h"
#include "circline/estimators/solver_registry.h"

namespace circline {

// For WorldRotation, where every feature has a noise of its own: never taken.
inline constexpr double kAnySigmaPx = 0.5;

struct Seed {
  CameraPose pose;
  double log_focal = 0.0;  // Of the camera that it was found with against the one given.
  // Who proposed it, from 1 up the closed forms, from -1 down the circles, the best known first.
  // The two poses of one circle, however close, are two seeds.
  int source = 0;
  int circle = -1;  // Index of the circle that proposed it.
};

// Close enough to lead to one minimum where the evidence agrees; where it does not, one may be
// stuck where some of it is an outlier.
bool IsSameSeed(const Seed& a, const Seed& b);

// Poses that the closed forms propose for the same world plane, in their order, and those of its
// circles. `resolved`: fitted, with a world (ResolveWorld) and a noise for every feature. `reasons`
// (may be null) receives why closed forms refused; other solvers are not asked.
std::vector<Seed> CollectSeeds(const Observations& resolved,
                               const std::vector<std::shared_ptr<const Solver>>& seeders,
                               double log_focal, std::vector<std::string>* reasons = nullptr);

// Of the best known circles alone: both planes of each, and, of an arc whose ellipse leaves them
// open and one pencil, planes all about the pencil's direction.
void AddCircleSeeds(const Observations& resolved, double log_focal, std::vector<Seed>* seeds);

// The same observations, fits included, through a camera of another focal length.
Observations Refocused(const Observations& resolved, double log_focal);

}  // namespace circline

#endif  // CIRCLINE_REFINE_POSE_SEEDS_H_
