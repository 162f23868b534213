// How much room a pose leaves to its circles.
#include <Eigen/Dense>
#include <cmath>
#include <limits>
#include <vector>

#include "circline/estimators/directions.h"
#include "circline/refine/joint/joint_result.h"
#include "circline/refine/joint/linearization.h"

namespace circline {
namespace {

// Log determinant of the covariance of where a circle's centre is seen (two angles, radians, times
// the focal length over that of the camera: the photo has as much room whatever its focal length)
// and of how large it is there (the logarithm of radius over distance), rotation and focal length
// given.
double LogVolume(const JointProblem& problem, const State& state, const Linearization& at,
                 const JointProblem::CircleBlocks& circle) {
  std::vector<int> given = at.Columns(JointProblem::kRotation), columns;
  if (problem.camera_is_estimated()) given.push_back(at.column(JointProblem::kCamera));
  columns = given;
  const auto num_given = static_cast<Eigen::Index>(given.size());
  Eigen::Matrix<double, 3, Eigen::Dynamic> seen(3, num_given);  // By these columns.
  seen.setZero();
  const CameraPose pose = problem.PoseAt(state);
  const Eigen::Vector2d center(problem.At(circle.center, state));
  const double radius = *problem.At(circle.radius, state);
  const Eigen::Vector3d X = pose.rotation.leftCols<2>() * center + pose.translation;
  Eigen::Matrix3d by_place;
  by_place << BasisAcross(X.normalized()).transpose(), -X.normalized().transpose();
  by_place /= X.norm();
  const auto add = [&](int block, const Eigen::Matrix<double, 3, Eigen::Dynamic>& slopes) {
    const std::vector<int> own = at.Columns(block);
    if (own.empty()) return;
    columns.insert(columns.end(), own.begin(), own.end());
    seen.conservativeResize(3, static_cast<Eigen::Index>(columns.size()));
    seen.rightCols(static_cast<Eigen::Index>(own.size())) = slopes;
  };
  const Block& t = problem.block(JointProblem::kTranslation);
  if (t.tangent_size() > 0)
    add(JointProblem::kTranslation, by_place * t.PlusJacobian(state.x.data() + t.offset));
  add(circle.center, by_place * pose.rotation.leftCols<2>());
  add(circle.radius, Eigen::Vector3d(0.0, 0.0, 1.0 / radius));
  const Eigen::MatrixXd C = at.Covariance(columns), by_given = seen * C.leftCols(num_given);
  const Eigen::MatrixXd C_given = C.topLeftCorner(num_given, num_given);
  return 4.0 * problem.LogFocalAt(state) +
         LogDetOfKnown(seen * C * seen.transpose() -
                       by_given *
                           C_given.completeOrthogonalDecomposition().solve(by_given.transpose()));
}

}  // namespace

std::vector<double> CircleVolumes(const JointProblem& problem, const State& state,
                                  const Linearization& at) {
  std::vector<double> volumes;
  for (const JointProblem::CircleBlocks& circle : problem.circles()) {
    volumes.push_back(state.Has(circle.feature) ? LogVolume(problem, state, at, circle)
                                                : std::numeric_limits<double>::quiet_NaN());
  }
  return volumes;
}

void CountCircleVolumes(std::vector<Refined>* all) {
  const std::size_t count = all->empty() ? 0 : all->front().circle_volumes.size();
  for (std::size_t i = 0; i < count; ++i) {
    double sum = 0.0, num = 0.0;
    for (const Refined& refined : *all) {
      if (!std::isfinite(refined.circle_volumes[i])) continue;
      sum += refined.circle_volumes[i];
      num += 1.0;
    }
    for (Refined& refined : *all) {
      if (std::isfinite(refined.circle_volumes[i]))
        refined.hypothesis.log_det += refined.circle_volumes[i] - sum / num;
    }
  }
}

}  // namespace circline
