// Information and covariance of a least-squares problem at its minimum, exact and without a sparse
// solver: parameters that appear in one residual block only are eliminated there. Internal.
#ifndef CIRCLINE_REFINE_COVARIANCE_H_
#define CIRCLINE_REFINE_COVARIANCE_H_

#include <ceres/cost_function.h>

#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "circline/refine/joint_evidence.h"

namespace circline {

// A residual block and the parameter blocks it reads.
struct ResidualTerm {
  std::unique_ptr<ceres::CostFunction> cost;
  std::vector<int> blocks;
};

// Values of all parameter blocks; blocks have at most three numbers.
using Values = std::vector<std::array<double, 3>>;

struct SharedCovariance {
  std::vector<int>
      offsets;  // Of each shared block's first column in `covariance`; -1 for private ones.
  Eigen::MatrixXd covariance;  // Of the shared parameters, pseudo-inverse on the observed subspace.
  Eigen::MatrixXd null_space;  // Orthonormal columns: directions without information.
  double log_det = 0.0;        // Of the covariance of all parameters, observed subspace.
};

// False if some residual cannot be evaluated or a private parameter carries no information. With
// `hold_spin` the third number of block 0 is no parameter.
bool ComputeCovariance(const std::vector<ResidualTerm>& terms,
                       const std::vector<ParameterInfo>& parameters, const Values& values,
                       bool hold_spin, SharedCovariance* out);

}  // namespace circline

#endif  // CIRCLINE_REFINE_COVARIANCE_H_
