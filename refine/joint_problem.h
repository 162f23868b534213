// One least-squares problem over everything that is known of the world plane: circles, lines,
// centres, axes, known angles and lengths (METHOD section 6), minimised in Ceres from one seed
// pose.
//
// Parameters. The plane's distance from the camera is the unit of length, and the plane's own frame
// has its origin at the foot of the perpendicular, so that a plane point (X, Y) is R (X, Y, facing)
// in the camera frame, facing = sign(r3 . t). Unknown are the rotation R, the world origin (where
// evidence fixes it), for each circle its centre and radius, for each line one angle about its
// pencil's direction, for each in-plane pencil of unknown direction one angle. A line's
// interpretation plane contains its direction whatever its offset: lines need not lie in the plane,
// and nothing is special at infinity.
//
// Residuals are distances in pixels of the photo over the standard deviation, one Ceres block per
// circle or line with the robust loss applied to each point inside it.
#ifndef CIRCLINE_REFINE_JOINT_PROBLEM_H_
#define CIRCLINE_REFINE_JOINT_PROBLEM_H_

#include <memory>

#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/status.h"
#include "circline/refine/estimate_pose.h"

namespace circline {

struct JointEvidence;

// Scatter of the points about a refined pose, pixels: 1.4826 x median absolute residual, degrees of
// freedom counted in; 0 where too few are redundant to tell.
struct ResidualScales {
  double conic_px = 0.0, line_px = 0.0;
};

// Where a few iterations lead from a seed.
struct Approach {
  CameraPose pose;
  double cost = 0.0;  // Robust, as PoseHypothesis::cost.
  ResidualScales scales;
};

class JointProblem {
 public:
  // `observations` fitted and resolved (FitObservations or FitDirect, then ResolveWorld). Features
  // without a fit, of other planes, or without any tie to the world frame take no part. Every
  // circle and pencil must state its sigma_px ("auto" is settled before).
  JointProblem(const Observations& observations, const EstimationOptions& options);
  ~JointProblem();

  // Refines `seed` (its rotation and, where the origin is known, its translation); fills everything
  // that a hypothesis holds but the probability. Not ok: degenerate evidence, or no convergence.
  Status Refine(const CameraPose& seed, PoseHypothesis* hypothesis) const;

  // The first iterations of Refine, without covariance: enough to see which basin a seed lies in.
  Status ApproachFrom(const CameraPose& seed, Approach* approach) const;

  // Robust cost at the seed with every other parameter at its closed-form value: ranks seeds
  // cheaply. Infinity where the seed is unusable.
  double SeedCost(const CameraPose& seed) const;

  // True if nothing fixes the rotation about the plane's normal.
  bool spin_is_free() const;

 private:
  std::unique_ptr<const JointEvidence> evidence_;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_JOINT_PROBLEM_H_
