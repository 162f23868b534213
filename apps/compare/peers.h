// What people use today, beside our solvers: rows that a reader of the table knows.
#ifndef CIRCLINE_APPS_COMPARE_PEERS_H_
#define CIRCLINE_APPS_COMPARE_PEERS_H_

#include <Eigen/Core>
#include <string>
#include <vector>

#include "apps/common/scene.h"
#include "circline/estimators/observations.h"
#include "circline/estimators/pose.h"
#include "circline/estimators/solver_registry.h"

namespace circline::apps {

// A neighbour's solver. Its evidence is the image's known points (`points` of the scene file; our
// own solvers do without), or the observations, fitted, whose camera is the photo's.
struct PeerSolver {
  using Function = PoseEstimate (*)(const SceneImage& image, const Observations& observations);

  std::string name;
  SolverStage stage = SolverStage::kClosedForm;
  std::string needs;  // In words, for --list_solvers.
  Function function = nullptr;

  // Refuses where evidence is missing. Hypotheses come best first, with no covariance (infinite)
  // and no probability (NaN), for the neighbours give none.
  PoseEstimate Solve(const SceneImage& image, const Observations& observations) const;
};

// In the order of the tables. Those of OpenCV where it was installed with its module calib3d:
// opencv_ippe (two poses, coplanar points), opencv_sqpnp, opencv_iterative. Those of OpenGV where
// the build has CIRCLINE_WITH_OPENGV: opengv_p3p (of the first three points; the others choose
// among its poses), opengv_upnp. Those of ViSP where it has CIRCLINE_WITH_VISP: visp_points,
// visp_circle.
std::vector<PeerSolver> PeerSolvers();
void AddOpenCvPeers(std::vector<PeerSolver>* peers);
void AddOpenGvPeers(std::vector<PeerSolver>* peers);
void AddVispPeers(std::vector<PeerSolver>* peers);

// What the neighbours share.

// The known points that a solver can use: seen by the camera, undistorted.
struct PeerPoints {
  std::vector<Eigen::Vector2d> calibrated;
  std::vector<Eigen::Vector3d> world;
};
// Refused if there are fewer than four.
Status UsablePoints(const SceneImage& image, const Camera& camera, PeerPoints* points);

// A pose of known points: metric, its residual that of the points.
PoseHypothesis PointsHypothesis(const CameraPose& pose, const SceneImage& image,
                                const Camera& camera);
// Those of known points: best first.
void SortByResidual(PoseEstimate* estimate);
// The metric pose of a peer; residual unknown.
PoseHypothesis PeerHypothesis(const CameraPose& pose);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMPARE_PEERS_H_
