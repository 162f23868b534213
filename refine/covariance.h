// Information and covariance of the joint problem at its minimum, exact and small: each feature's
// own unknowns are eliminated where they stand. Internal: not installed.
#ifndef CIRCLINE_REFINE_COVARIANCE_H_
#define CIRCLINE_REFINE_COVARIANCE_H_

#include <Eigen/Core>
#include <vector>

#include "circline/refine/joint_evidence.h"
#include "circline/refine/reduced_problem.h"

namespace circline {

struct SharedCovariance {
  std::vector<int> offsets;    // Of each shared block's first column; -1 for features' own.
  Eigen::MatrixXd covariance;  // Of the shared unknowns, pseudo-inverse on the observed subspace.
  Eigen::MatrixXd null_space;  // Orthonormal columns: directions without information.
  // Log determinants of covariances, observed subspace: of the shared unknowns (but those that
  // known lengths alone have), and of what each circle and line has of its own.
  double log_det = 0.0;
  std::vector<double> circle_log_det, line_log_det;
};

// From the inliers at `state` (within their gate times `gate_stretch`), without loss. False if some
// residual cannot be evaluated or an own unknown carries no information. The spin about the normal
// is held where nothing fixes it: its row and column (2) are then zero.
bool ComputeCovariance(const JointEvidence& evidence, const JointState& state,
                       SharedCovariance* out, double gate_stretch = 1.0);

}  // namespace circline

#endif  // CIRCLINE_REFINE_COVARIANCE_H_
