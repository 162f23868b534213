// The joint problem at a place as one linear system: covariance, volumes, and how far each feature
// contradicts the others. From the Jacobians of the same cost functions that ceres solves for.
// Internal: not installed.
//
// The pose and the camera, the core, meet everything and are few: dense. All other unknowns meet
// few others: sparse, and eliminated first, so that the time is linear in their number.
#ifndef CIRCLINE_REFINE_LINEARIZATION_H_
#define CIRCLINE_REFINE_LINEARIZATION_H_

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "circline/refine/inverse_on_pattern.h"
#include "circline/refine/joint_problem.h"

namespace circline {

class Linearization {
 public:
  // The active terms at `state`. Not ok() where some cannot be evaluated.
  Linearization(const JointProblem& problem, const State& state, const Weighing& weighing);
  bool ok() const { return ok_; }

  // First column of a block in tangent space; -1 for constants and for what no active term has. The
  // core's come first, and last of them the camera's, whether it is estimated or not.
  int column(int block) const { return columns_[static_cast<std::size_t>(block)]; }
  int core_size() const { return core_size_; }

  // Covariance, pseudo-inverse on the observed subspace of the core. A camera that is not estimated
  // is counted by its prior: Sigma_x + S Sigma_camera S^T, S how the others follow it ("consider"
  // covariance). Also fills null_space(), of the core. False where the other unknowns carry no
  // information.
  bool ComputeCovariance();
  const Eigen::MatrixXd& covariance() const { return covariance_; }  // Of the core.
  const Eigen::MatrixXd& null_space() const { return null_space_; }
  // Of unknowns of the core and of such as share a residual, n x n for n columns.
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
  // Residuals of one or several features or priors, by the columns that they have.
  struct Rows {
    int feature = -1;
    std::vector<int> columns;
    Eigen::MatrixXd J;
    Eigen::VectorXd f;
  };
  // F^T S F: what the information holds too much of, by a loss.
  struct Overcounted {
    std::vector<int> columns;  // Of F.
    Eigen::MatrixXd F, S;
  };

  void LayOut();
  bool AddTerm(const Term& term, const Weighing& weighing);
  void TakeLoss(const Term& term, double twice_cost, Rows* rows);
  const Eigen::MatrixXd& PlusJacobian(int block);  // Of the block's manifold, worked out once.
  Rows Together(const std::vector<std::size_t>& parts) const;
  Eigen::MatrixXd EliminateOthers();
  void AddOvercounted(const Eigen::MatrixXd& inverse);
  Misfit MisfitOf(std::size_t feature, const std::vector<std::size_t>& parts) const;

  const JointProblem& problem_;
  const State& state_;
  bool ok_ = true;
  std::vector<int> columns_;  // By block.
  std::vector<int> groups_;   // By column: Block::group.
  int core_size_ = 0,
      num_estimated_ = 0;  // Columns of the core, and those without a camera's prior.
  std::vector<Rows> rows_;
  std::vector<std::vector<std::size_t>> together_;  // Of rows_: by group, then one prior each.
  std::vector<Overcounted> overcounted_;
  std::vector<Eigen::MatrixXd> plus_;  // By block.
  std::vector<double> ambient_;        // Jacobians of one term, as its cost function writes them.
  // The others x follow the core y: x = -gain y + n. Covariances of n, and between n and the core.
  std::optional<InverseOnPattern> others_;
  Eigen::MatrixXd gain_, with_core_;
  Eigen::VectorXd diagonal_;  // Of the core's information, if all others were known.
  Eigen::MatrixXd covariance_, null_space_;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_LINEARIZATION_H_
