// What the joint problem says at a minimum: a hypothesis with its uncertainty, and in words.
// Internal: not installed.
#ifndef CIRCLINE_REFINE_JOINT_JOINT_RESULT_H_
#define CIRCLINE_REFINE_JOINT_JOINT_RESULT_H_

#include <cstdint>
#include <string>
#include <vector>

#include "circline/estimators/pose.h"
#include "circline/estimators/status.h"
#include "circline/refine/block_chain.h"
#include "circline/refine/joint/joint_problem.h"
#include "circline/refine/joint/linearization.h"

namespace circline {

// A hypothesis without probability. Its log_det is that of the covariance of the rotation (and of
// the focal length, where that is estimated), until CountCircleVolumes: volumes of all else,
// measured on the photo, are alike whatever the pose, and what a feature left out would have said
// of the rotation is in its LeftOutCost.
struct Refined {
  PoseHypothesis hypothesis;
  State state;
  // By circle of the problem: log determinant of the covariance of where and how large it is seen,
  // the rotation given; NaN where it takes no part.
  std::vector<double> circle_volumes;
  std::vector<std::string> notes;  // What was left out, and why.
};

// Where a circle of the world's plane lies in the camera frame, its lengths times `unit`; nothing
// else of the estimate.
void PlaceEstimate(const PlaneCircle& circle, const CameraPose& pose, double unit,
                   const Camera& camera, CircleEstimate* estimate);

// Log determinant of a covariance, angles and logarithms: over its principal axes; those of which
// nothing is known have a variance of `most`, and none has more.
double LogDetOfKnown(const Eigen::MatrixXd& covariance, double most = 1.0);

// Fills everything but the probability from a minimum. Not ok: no feature has inliers, or some
// number is not finite.
Status FillRefined(const JointProblem& problem, State state, Refined* refined);

// What was found of the focal length, in words; none where it is not estimated. Other notes are of
// a minimum; this one is of what is returned, which may be several merged.
std::string FocalNote(const JointProblem& problem, const PoseHypothesis& h);

// --- circle_volumes.cc

// As Refined has them.
std::vector<double> CircleVolumes(const JointProblem& problem, const State& state,
                                  const Linearization& at);

// Adds to each log_det by how much its circles have more room than under the others. A whole circle
// has the same under all; an arc leaves the one pose its tilt open, and the other its size.
void CountCircleVolumes(std::vector<Refined>* all);

// --- joint_inliers.cc

// Counts and rms of the inliers. Returns how much wider the estimate scatters than least squares on
// the inliers would: the variance of an M-estimate, E[psi^2] / E[psi']^2 over residuals in standard
// deviations (Huber 1964), where enough of them are redundant to measure it, and never less than
// what every loss is tuned to.
double CountInliers(const JointProblem& problem, const State& state, PoseHypothesis* h);

// Makes features inactive that are outliers as a whole; true where there were any.
bool DropOutliers(const JointProblem& problem, State* state);

// --- left_out.cc

// What all features left out cost together: their own free fits, and what clutter would cost. One
// feature in fifty is clutter, and more in a photo that has some; clutter may have any direction.
double LeftOutCost(const JointProblem& problem, const State& state);

// Takes in what a minimum leaves out but agrees with it: the same pose on more evidence. Costs are
// with LeftOutCost.
void TakeBackWhatFits(const JointProblem& problem, State* minimum);

}  // namespace circline

#endif  // CIRCLINE_REFINE_JOINT_JOINT_RESULT_H_
