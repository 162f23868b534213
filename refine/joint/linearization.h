// A graph at a place as one linear system: covariances, and how far each feature contradicts the
// others. From the Jacobians of the same cost functions that ceres solves for. Internal: not
// installed.
//
// Sparse, and of the inverse only what the factor has a place for: the time is linear in the number
// of features.
#ifndef CIRCLINE_REFINE_JOINT_LINEARIZATION_H_
#define CIRCLINE_REFINE_JOINT_LINEARIZATION_H_

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "circline/refine/graph.h"
#include "circline/refine/joint/inverse_on_pattern.h"
#include "circline/refine/joint/joint_problem.h"

namespace circline {

class Linearization {
 public:
  struct Options {
    // Blocks among which some direction may have no information; a rotation first. Few, and dense.
    std::vector<int> core;
    // A block that is held, but whose error counts ("consider" covariance), -1: none. And the
    // standard deviations of its numbers.
    int considered = -1;
    Eigen::VectorXd considered_sigmas;
    // Information that is added to every unknown, of what it has and in itself.
    double floor = 0.0;
    // Whether x is where the terms cost least; else how far what a loss counts for more than it
    // says has moved it is not known.
    bool at_minimum = true;
  };
  // Terms of a graph at x. Not ok() where some cannot be evaluated.
  Linearization(const Graph& graph, const std::vector<const Term*>& terms, const double* x,
                const Weighing& weighing, Options options);
  // The active terms of one photo; pose and camera are the core, a camera that is not estimated is
  // considered.
  Linearization(const JointProblem& problem, const State& state, const Weighing& weighing);
  bool ok() const { return ok_; }

  // First column of a block in tangent space; -1 for constants and for what no term has. The core's
  // come first.
  int column(int block) const { return columns_[static_cast<std::size_t>(block)]; }
  std::vector<int> Columns(int block) const;  // All of them; empty where column() is -1.
  int core_size() const { return core_size_; }

  // The inverse of the information, pseudo-inverse on the observed subspace of the core; then
  // + X S X^T of what is considered, X how the unknowns follow it, and of priors that a loss counts
  // for more than they say. Also fills null_space(), of the core. False where the other unknowns
  // carry no information.
  bool ComputeCovariance();
  const Eigen::MatrixXd& covariance() const { return covariance_; }  // Of the core.
  const Eigen::MatrixXd& null_space() const { return null_space_; }
  // Of unknowns that share a residual, n x n for n columns.
  Eigen::MatrixXd Covariance(const std::vector<int>& columns) const;
  // Derivatives of something by the values of a block.
  struct Slope {
    int block;
    Eigen::MatrixXd by_values;
  };
  // Of what follows blocks so. Those that are constant, or that no term has, have no part in it.
  Eigen::MatrixXd Covariance(const std::vector<Slope>& slopes) const;

  // --- Of one photo. ---

  // By feature: d^2 = 2 (C(all) - C(without it) - C(its own free fit)), to second order, and its
  // degrees of freedom; 0 for what is inactive or has no test. Needs ComputeCovariance.
  struct Misfit {
    double d2 = 0.0;
    int dof = 1;
  };
  std::vector<Misfit> Misfits() const;
  // Variance of one coordinate of a block that a feature has of its own, all unknowns held that it
  // shares with others.
  double OwnVariance(int feature, int block, int coordinate) const;

 private:
  // Residuals of one or several terms, by the columns that they have.
  struct Rows {
    int feature = -1;
    std::vector<int> columns;
    Eigen::MatrixXd J;
    Eigen::VectorXd f;
  };
  // X S X^T, a part of the covariance.
  struct Part {
    Eigen::MatrixXd X, S;
  };

  void LayOut(const std::vector<const Term*>& terms);
  bool AddTerm(const Term& term, const Weighing& weighing);
  void CountLoss(const Term& term, double twice_cost, Rows* rows);
  const Eigen::MatrixXd& PlusJacobian(int block);  // Of the block's manifold, worked out once.
  Rows Together(const std::vector<std::size_t>& parts) const;
  std::vector<int> CoreColumns() const;
  InverseOnPattern::Sparse Information(Eigen::MatrixXd* with_considered) const;
  bool Invert(InverseOnPattern::Sparse information);
  void AddConsidered(const Eigen::MatrixXd& with_considered);
  void AddOvercounted();
  Misfit MisfitOf(std::size_t feature) const;

  const Graph& graph_;
  const double* x_;
  const Options options_;
  bool ok_ = true;
  std::vector<int> columns_;              // By block.
  std::vector<int> uses_;                 // By column: terms that have it.
  int core_size_ = 0, num_unknowns_ = 0;  // Columns; those of what is considered come last.
  std::vector<Rows> rows_;
  const std::vector<Feature>* features_ = nullptr;  // Of one photo.
  // By feature: its own, and those of what says nothing without it.
  std::vector<std::vector<std::size_t>> rows_of_;
  // F, where F^T F is what the information holds too much of, by a loss; and what F misses by.
  std::vector<Eigen::Triplet<double>> overcounted_;
  std::vector<double> overcounted_residuals_;
  std::vector<Eigen::MatrixXd> plus_;  // By block.
  std::vector<double> ambient_;        // Jacobians of one term, as its cost function writes them.
  std::optional<InverseOnPattern> inverse_;
  std::vector<Part> parts_;
  Eigen::MatrixXd covariance_, null_space_;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_JOINT_LINEARIZATION_H_
