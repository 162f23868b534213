// What people use today, beside our solvers: rows that a reader of the table knows.
#ifndef CIRCLINE_APPS_COMPARE_PEERS_H_
#define CIRCLINE_APPS_COMPARE_PEERS_H_

#include <string>
#include <vector>

#include "apps/common/scene.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/solver_registry.h"

namespace circline::apps {

// A pose from known points of the world, which the scene file gives (`points`); our own solvers do
// without them.
struct PeerSolver {
  std::string name;
  SolverStage stage = SolverStage::kClosedForm;
  int method = 0;  // OpenCV's number for it.

  // Refuses without enough points. Hypotheses have no covariance (infinite) and no probability
  // (NaN), for OpenCV gives none.
  PoseEstimate Solve(const SceneImage& image) const;
};

// opencv_ippe (two poses, coplanar points), opencv_iterative, opencv_sqpnp. Empty where OpenCV was
// installed without its module calib3d.
std::vector<PeerSolver> PeerSolvers();

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_PEERS_H_
