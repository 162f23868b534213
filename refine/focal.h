// The focal length as one more unknown: one scale on fx and fy, with a prior, profiled out of the
// joint problem. Internal: not installed.
#ifndef CIRCLINE_REFINE_FOCAL_H_
#define CIRCLINE_REFINE_FOCAL_H_

#include <Eigen/Core>

#include "circline/estimators/status.h"
#include "circline/refine/joint_evidence.h"
#include "circline/refine/reduced_problem.h"

namespace circline {

// The same evidence, point by point, through a camera whose focal lengths are exp(log_focal) times
// as long; the lens distortion bends the same rays.
class RefocusedEvidence {
 public:
  RefocusedEvidence(const JointEvidence& base, double log_focal);

  // False where that camera cannot have seen one of the points (beyond the range in which its
  // distortion is one-to-one): such a focal length is out of the question.
  bool is_possible() const { return is_possible_; }
  const JointEvidence& evidence() const { return evidence_; }
  // Keeps the inliers of `state` within `gate` standard deviations, without loss.
  void KeepInliers(const JointState& state, const JointEvidence& at, double gate);

 private:
  JointEvidence evidence_;
  bool is_possible_ = true;
};

// What the inliers at a minimum say of the focal length, every other unknown free to follow.
struct FocalModel {
  double information = 0.0;  // Of log_focal, without prior.
  // d cost / d log_focal under the losses, prior included, with every other unknown held, which at
  // their minimum is that of the cost left by them.
  double slope = 0.0;
  // Along the valley, by log_focal: the shared unknowns by column, and all of them by block (of
  // block 0, the rotation, delta).
  Eigen::VectorXd by_focal;
  Values by_block;
};

// False where the evidence cannot be evaluated. `shared_covariance`: ComputeCovariance's. Inliers
// lie within `stretch` times their gate.
bool ComputeFocalModel(const JointEvidence& base, const JointState& state, double log_focal,
                       double stretch, const Eigen::MatrixXd& shared_covariance, FocalModel* model);

// 1/2 (log_focal / prior sigma)^2; 0 where the focal length is fixed.
double FocalPriorCost(const JointEvidence& evidence, double log_focal);

// Minimize (minimize.h) with graduated losses over the focal length as well: steps of
// Newton's method on the cost left by the others.
Status MinimizeWithFocal(const JointEvidence& base, double tolerance, JointState* state,
                         double* log_focal);

}  // namespace circline

#endif  // CIRCLINE_REFINE_FOCAL_H_
