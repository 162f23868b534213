// What the joint problem says at its minimum: a hypothesis with its uncertainty, and in words.
// Internal: not installed.
#ifndef CIRCLINE_REFINE_JOINT_RESULT_H_
#define CIRCLINE_REFINE_JOINT_RESULT_H_

#include <cstdint>
#include <string>
#include <vector>

#include "circline/estimators/pose.h"
#include "circline/estimators/status.h"
#include "circline/refine/joint_evidence.h"
#include "circline/refine/reduced_problem.h"

namespace circline {

// A hypothesis without probability, and what it takes to compare it with others.
struct Refined {
  PoseHypothesis hypothesis;
  // Log determinants of the covariance of the shared unknowns and of what each circle, then each
  // line, has of its own; the same features that the hypothesis does not explain; circles' radii.
  double shared_log_det = 0.0;
  std::vector<double> own_log_det;
  std::vector<std::uint8_t> left_out;
  std::vector<double> radii;
  std::vector<int> radius_blocks;  // Circles with the same one share their radius; -1: its own.
  std::vector<std::string> notes;  // What was left out, and why.
};

// Log determinant of the covariance of all unknowns but those of the features left out, in
// parameters in which a scene is as likely anywhere: rotations by their invariant measure, the
// first circle's centre uniform in space in units of its radius, the others in the plane in the
// same unit, radii (a shared one once) by their logarithm. Hypotheses compare on the features that
// all of them explain.
double LogDet(const Refined& refined, const std::vector<std::uint8_t>& left_out);

// The pose of a state. Where evidence does not fix the origin, it is the point of the plane that
// `convention` has there.
CameraPose PoseAt(const JointEvidence& evidence, const JointState& state,
                  const CameraPose& convention);

// Fills everything but the hypothesis' cost, which `refined` has already, at the minimum `state` of
// `evidence`: that of `base`, seen with focal lengths exp(log_focal) times as long. Not ok: some
// number is not finite, or some feature has no inliers.
Status FillRefined(const JointEvidence& base, double log_focal, const JointEvidence& evidence,
                   const CameraPose& convention, JointState state, Refined* refined);

}  // namespace circline

#endif  // CIRCLINE_REFINE_JOINT_RESULT_H_
