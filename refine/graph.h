// Parameter blocks and the residual blocks on them, for ceres and for what comes after it: what the
// refinements of one photo and of many are made of. Internal: not installed.
#ifndef CIRCLINE_REFINE_GRAPH_H_
#define CIRCLINE_REFINE_GRAPH_H_

#include <ceres/loss_function.h>
#include <ceres/manifold.h>
#include <ceres/problem.h>

#include <Eigen/Core>
#include <cstddef>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "circline/refine/cost_functions.h"

namespace circline {

// Matrices of one block do not allocate.
using BlockMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kCameraSize, kCameraSize>;
using BlockVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kCameraSize, 1>;

// Of a camera of which some shifts are held, those with a standard deviation of 0; null where all
// are.
std::unique_ptr<ceres::Manifold> ShiftManifold(const Shifts& sigmas);

// A term has no more blocks.
constexpr std::size_t kMostBlocks = 8;

// One parameter block.
struct Block {
  int offset, size;                           // In the values of all.
  std::unique_ptr<ceres::Manifold> manifold;  // Null: Euclidean.
  bool is_constant = false;

  int tangent_size() const {
    return is_constant ? 0 : manifold != nullptr ? manifold->TangentSize() : size;
  }
  // Of its manifold, constant or not: ambient by tangent size.
  BlockMatrix PlusJacobian(const double* at) const;
  // Coordinates about a place: MinusJacobian there, which is linear, times the difference; tangent
  // by ambient size.
  BlockMatrix Chart(const double* at) const;
};

// One residual block.
struct Term {
  std::unique_ptr<ceres::CostFunction> cost;
  std::vector<int> blocks;
  int feature = -1;                // -1: a prior.
  FeatureCost* weighed = nullptr;  // The same, where it can be weighed anew.
  // Of a prior that is no Gaussian.
  std::unique_ptr<ceres::LossFunction> loss;
  // The covariance is that of the residuals without the loss; else that which the loss makes of it.
  bool is_mostly_exact = true;
  // The same, but that the Gaussian stands in the information from the first: of what many features
  // have each of its own, in linear time. Nothing is told of how far it lies from where it would.
  bool is_counted_at_once = false;
  // Of a pencil's prior about its axis (LeanShape): counted in the covariance.
  std::optional<Eigen::Matrix3d> lean_shape = std::nullopt;
};

// Blocks and terms by the order in which they were added.
class Graph {
 public:
  // What is not in `value` is 0.
  int AddBlock(int size, const std::vector<double>& value,
               std::unique_ptr<ceres::Manifold> manifold = {}, bool is_constant = false);
  // A block of zeros about which a prior is Gaussian, with these standard deviations, under a loss
  // or none.
  int AddDeviation(const std::vector<double>& sigmas, int feature = -1,
                   std::unique_ptr<ceres::LossFunction> loss = {});
  // How far a circle is out of round (PlaneCircleContourCost), about zeros.
  int AddShape(double sigma, int feature = -1);
  void SetManifold(int block, std::unique_ptr<ceres::Manifold> manifold) {
    this->block(block).manifold = std::move(manifold);
  }
  // Points of a feature, or a prior, of a feature or of none. Blocks of -1 are left out.
  int AddTerm(ceres::CostFunction* owned, std::vector<int> blocks, int feature = -1,
              std::unique_ptr<ceres::LossFunction> loss = {});

  const std::vector<Block>& blocks() const { return blocks_; }
  const std::vector<Term>& terms() const { return terms_; }
  const Block& block(int i) const { return blocks_[static_cast<std::size_t>(i)]; }
  Block& block(int i) { return blocks_[static_cast<std::size_t>(i)]; }
  const Term& term(int i) const { return terms_[static_cast<std::size_t>(i)]; }
  Term& term(int i) { return terms_[static_cast<std::size_t>(i)]; }
  // Values of all blocks, as added or as its user has changed them since; below, x.
  const std::vector<double>& values() const { return values_; }
  double* Values(int block) { return values_.data() + this->block(block).offset; }
  const double* Values(int block) const { return values_.data() + this->block(block).offset; }

  void Parameters(const Term& term, const double* x, const double** out) const;
  // Infinity where it cannot be evaluated.
  double TwiceCost(const Term& term, const double* x) const;
  // The largest root mean square of a feature's points without any loss, standard deviations.
  double LargestRms(const std::vector<const Term*>& terms, const double* x) const;
  // Of all terms that can be.
  void SetWeighing(const Weighing& weighing) const;
  // Those that these terms have, in the order in which they have them.
  std::vector<int> BlocksOf(const std::vector<const Term*>& terms) const;
  // Puts these terms, and the blocks that they have, into a problem that owns nothing of them.
  // Returns the number of unknowns.
  int Fill(const std::vector<const Term*>& terms, double* x, ceres::Problem* problem) const;

 private:
  std::vector<Block> blocks_;
  std::vector<Term> terms_;
  std::vector<double> values_;
};

}  // namespace circline

#endif  // CIRCLINE_REFINE_GRAPH_H_
