// One least-squares problem over everything that is known of the world plane: circles, lines,
// centres, axes, known angles and lengths, minimised in Ceres from one seed pose.
//
// Parameters. The plane's distance from the camera is the unit of length, and the plane's own frame
// has its origin at the foot of the perpendicular, so that a plane point (X, Y) is R (X, Y, facing)
// in the camera frame, facing = sign(r3 . t). Unknown are the rotation R, the world origin (where
// evidence fixes it), for each circle its centre and radius, for each line one angle about its
// pencil's direction, for each in-plane pencil of unknown direction one angle. A line's
// interpretation plane contains its direction whatever its offset: lines need not lie in the plane,
// and nothing is special at infinity.
//
// Residuals are distances in pixels of the photo over the standard deviation, each under its robust
// loss. The solver sees the shared unknowns alone (reduced_problem.h). Internal: not installed.
#ifndef CIRCLINE_REFINE_JOINT_PROBLEM_H_
#define CIRCLINE_REFINE_JOINT_PROBLEM_H_

#include <optional>
#include <string>
#include <vector>

#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/status.h"
#include "circline/refine/estimate_pose.h"
#include "circline/refine/focal.h"
#include "circline/refine/joint_evidence.h"
#include "circline/refine/joint_result.h"
#include "circline/refine/reduced_problem.h"

namespace circline {

// Where a few iterations lead from a seed.
struct Approach {
  CameraPose pose;
  double cost = 0.0;  // Robust, as PoseHypothesis::cost.
  // Scatter of the points whose noise is automatic, pixels: 1.4826 x median absolute residual,
  // degrees of freedom counted in; 0 where too few are redundant to tell.
  NoiseScales scales;
  JointState state;
  double log_focal = 0.0;  // Of the focal lengths' scale, where that is refined too.
};

class JointProblem {
 public:
  // `observations` fitted and resolved (FitObservations or FitDirect, then ResolveWorld); they and
  // the options outlive this. Features without a fit, of other planes, or without any tie to the
  // world frame take no part. `scales`: positive.
  JointProblem(const Observations& observations, const EstimationOptions& options,
               const NoiseScales& scales)
      : evidence_(observations, options, scales) {}

  void SetScales(const NoiseScales& scales) { evidence_.SetScales(scales); }

  // Robust cost at the seed with every other parameter at its closed-form value: ranks seeds
  // cheaply. Refused where the seed contradicts the evidence.
  Status SeedCost(const CameraPose& seed, double* cost) const;

  // The first iterations from a seed (its rotation and, where the origin is known, its
  // translation), or further ones: enough to see which basin it lies in.
  Status ApproachFrom(const CameraPose& seed, Approach* approach) const;
  Status Continue(Approach* approach) const;

  // Share of the points of contours and lines that are inliers there.
  double InlierShare(const Approach& approach) const;

  // Runs an approach to its end; fills everything that a hypothesis holds but the probability. Not
  // ok: degenerate evidence, or numbers that are not finite.
  Status Refine(const Approach& approach, Refined* refined) const;

  // What the observations say that has no part in the problem, and why, a sentence each.
  const std::vector<std::string>& unused() const { return evidence_.unused; }

  // True if so many points are doubted that some features' fits may be wrong.
  bool is_contaminated() const;

  // True if nothing fixes the rotation about the plane's normal.
  bool spin_is_free() const { return !evidence_.x_is_fixed; }

 private:
  // The evidence through the camera of an approach; `refocused` holds it where need be.
  const JointEvidence& At(const Approach& approach,
                          std::optional<RefocusedEvidence>* refocused) const;
  double Cost(const JointEvidence& evidence, const Approach& approach) const;

  JointEvidence evidence_;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_JOINT_PROBLEM_H_
