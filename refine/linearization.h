// The joint problem at a place as one linear system: information, covariance, volumes, and how far
// each feature contradicts the others. From the Jacobians of the same cost functions that ceres
// solves for. Internal: not installed.
//
// Unknowns are of three kinds. A feature's own (a circle's tilt) are eliminated first. Of the
// shared ones, leaves (a pencil's direction, those of pencils at known angles) meet the core (the
// pose, the camera, the contours' offset) and no other leaf: they are eliminated one by one, so
// that the time is linear in their number.
#ifndef CIRCLINE_REFINE_LINEARIZATION_H_
#define CIRCLINE_REFINE_LINEARIZATION_H_

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <vector>

#include "circline/refine/joint_problem.h"

namespace circline {

class Linearization {
 public:
  // The active terms at `state`. Not ok() where some cannot be evaluated.
  Linearization(const JointProblem& problem, const State& state, const Weighing& weighing);
  bool ok() const { return ok_; }

  // First column of a block in the shared unknowns, tangent space; -1 for constants and for what a
  // feature has of its own. The core's come first, and last of them the camera's, whether it is
  // estimated or not.
  int column(int block) const { return columns_[static_cast<std::size_t>(block)]; }
  int core_size() const { return static_cast<int>(information_.core.rows()); }

  // Covariance of the shared unknowns, pseudo-inverse on the observed subspace. A camera that is
  // not estimated is counted by its prior: Sigma_x + S Sigma_camera S^T, S how the others follow it
  // ("consider" covariance). Also fills null_space(), of the core. False where a feature's own
  // unknowns carry no information.
  bool ComputeCovariance();
  const Eigen::MatrixXd& covariance() const { return covariance_; }  // Of the core.
  const Eigen::MatrixXd& null_space() const { return null_space_; }
  // Of any shared unknowns, n x n for n columns.
  Eigen::MatrixXd Covariance(const std::vector<int>& columns) const;

  // By feature: d^2 = 2 (C(all) - C(without it) - C(its own free fit)), to second order, and its
  // degrees of freedom; 0 for what is inactive or has no test. Needs ComputeCovariance.
  struct Misfit {
    double d2 = 0.0;
    int dof = 1;
  };
  std::vector<Misfit> Misfits() const;
  // Variance of one coordinate of a block that a feature has of its own, all shared unknowns held.
  double OwnVariance(int block, int coordinate) const;

 private:
  // Residuals of one feature or prior.
  struct Rows {
    int feature, group;
    Eigen::MatrixXd J;         // Rows by local columns.
    std::vector<int> columns;  // Of J: >= 0 shared, < 0: own column -1 - k of the group.
    Eigen::VectorXd f;
    double twice_cost = 0.0;
  };
  // The own unknowns x of a feature follow the shared ones y: x = -gain y.
  struct Group {
    int size = 0;                   // Own columns.
    std::vector<std::size_t> rows;  // Index in rows_.
    std::vector<int> shared;        // Columns.
    Eigen::MatrixXd inverse, gain;  // Of the information of the own part.
  };
  // Symmetric, with the rows and columns of the shared unknowns: zero between two leaves.
  struct Arrow {
    struct Leaf {
      Eigen::MatrixXd own, with_core;
    };
    Eigen::MatrixXd core;
    std::vector<Leaf> leaves;
  };
  // The unknowns x of a leaf follow those y of the core that it meets: x = -gain y + n.
  struct Leaf {
    int first = 0, size = 0;                // Columns.
    std::vector<int> meets;                 // Of the core's columns.
    Eigen::MatrixXd gain, inverse;          // Of the information of the own part.
    Eigen::MatrixXd covariance, with_core;  // Of n, and between n and all of the core.
  };
  // F^T S F: what the information holds too much of, by a loss.
  struct Overcounted {
    std::vector<int> columns;  // Of F; those of one leaf at most.
    Eigen::MatrixXd F, S;
  };
  static int IndexIn(const std::vector<int>& columns, int column) {
    return static_cast<int>(std::find(columns.begin(), columns.end(), column) - columns.begin());
  }

  std::size_t LeafAt(int column) const {
    return static_cast<std::size_t>(leaf_at_[static_cast<std::size_t>(column - core_size())]);
  }
  void LayOut();
  std::vector<std::vector<int>> FindLeaves() const;  // The blocks of each.
  void Add(int row, int column, double value);
  void AddInformation(const Eigen::MatrixXd& J, const std::vector<int>& columns);
  bool AddTerm(const Term& term, const Weighing& weighing);
  void TakeLoss(const Term& term, Rows* rows);
  bool Eliminate(Group* group);
  bool Eliminate(std::size_t leaf);
  Eigen::MatrixXd AlongCore(const Overcounted& over) const;
  void AddOvercounted(const Eigen::MatrixXd& inverse);
  const Eigen::MatrixXd& PlusJacobian(int block);  // Of the block's manifold, worked out once.
  // The covariance of some shared unknowns, which the lines of a pencil have in common.
  struct Known {
    std::vector<int> columns;
    Eigen::MatrixXd covariance;
  };
  void Leverage(const std::vector<const Rows*>& parts, Known* known, Eigen::MatrixXd* S,
                Eigen::VectorXd* f) const;
  Misfit MisfitOf(std::size_t feature, const std::vector<const Rows*>& parts, Known* known) const;

  const JointProblem& problem_;
  const State& state_;
  bool ok_ = true;
  std::vector<int> columns_, own_columns_;
  int num_estimated_ = 0;  // Columns of the core.
  std::vector<Group> groups_;
  std::vector<Rows> rows_;
  std::vector<Eigen::MatrixXd> plus_;  // By block.
  std::vector<double> ambient_;        // Jacobians of one term, as its cost function writes them.
  std::vector<Leaf> leaves_;
  std::vector<int> leaf_at_;  // By column beyond the core's.
  Arrow information_;
  std::vector<Overcounted> overcounted_;
  Eigen::MatrixXd covariance_, null_space_;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_LINEARIZATION_H_
