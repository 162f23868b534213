// The joint problem as its solver (minimize.h) sees it: only the shared unknowns (the rotation, the
// origin, common centres, directions and scales), each circle's and line's own ones eliminated
// where they stand (Schur's complement). Small and dense, however many features there are.
// Internal: not installed.
#ifndef CIRCLINE_REFINE_REDUCED_PROBLEM_H_
#define CIRCLINE_REFINE_REDUCED_PROBLEM_H_

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "circline/estimators/status.h"
#include "circline/refine/joint_evidence.h"
#include "circline/refine/quadratic_models.h"

namespace circline {

// Values of all parameter blocks; blocks have at most three numbers.
using Values = std::vector<std::array<double, 3>>;

// Where a refinement stands.
struct JointState {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  double facing = -1.0;
  Values values;  // Of block 0, the rotation, unused.
  // By term of the evidence, 1 = left out: circles and lengths that cannot lie on this plane in
  // front of the camera, and what turned out to be an outlier as a whole.
  std::vector<std::uint8_t> circle_left_out, line_left_out, point_left_out, length_left_out;

  double* At(int block) { return values[static_cast<std::size_t>(block)].data(); }
  const double* At(int block) const { return values[static_cast<std::size_t>(block)].data(); }
};

// Columns of the shared unknowns. Without evidence for it the spin about the normal is none.
struct SharedColumns {
  explicit SharedColumns(const JointEvidence& evidence);

  std::vector<int> offsets;  // By block; -1 for a feature's own. Block 0 has `rotation` columns.
  int rotation = 3, size = 0;
};

// 1/2 sum rho over all evidence; infinity where some residual cannot be evaluated.
double JointCost(const JointEvidence& evidence, const JointState& state,
                 const SetWeighing& weighing);

// A feature's own unknowns follow the shared ones: own = own at the linearisation + step - gain *
// (shared - shared at the linearisation). Column indices are local ones of the feature's model.
struct OwnUnknowns {
  int size = 0, shared_size = 0;
  std::array<std::uint8_t, 6> own{}, shared{};  // Local columns.
  std::array<int, 6> own_block{}, own_index{};
  std::array<int, 6> shared_column{};
  std::array<double, 3> step{};
  Eigen::Matrix<double, 3, 6> gain = Eigen::Matrix<double, 3, 6>::Zero();
};

// Quadratic model of the whole problem in the shared unknowns, the rotation as delta.
struct ReducedModel {
  double cost = 0.0;
  Eigen::VectorXd gradient;
  Eigen::MatrixXd hessian;
  std::vector<OwnUnknowns> eliminated;  // One for each term with unknowns of its own.
  double own_gain = 0.0;                // What these lower the cost by, the shared unknowns held.
  // Log determinants of the own unknowns' information by term of the evidence, 0 where there are
  // none.
  std::vector<double> circle_log_det, line_log_det;
};

// False if some residual cannot be evaluated or an own unknown carries no information.
bool Linearize(const JointEvidence& evidence, const JointState& state, const SharedColumns& columns,
               const SetWeighing& weighing, ReducedModel* model);

// Normal of a line's interpretation plane in the world frame, and its derivatives by the unknowns
// of LineTerm's blocks, in order.
Eigen::Vector3d LineNormal(const LineTerm& term, const JointState& state, Eigen::Matrix3d* by_own);

}  // namespace circline

#endif  // CIRCLINE_REFINE_REDUCED_PROBLEM_H_
