// The unknowns of a box and its ceres::Problem.
#ifndef CIRCLINE_APPS_RECONSTRUCT_BOX_PROBLEM_H_
#define CIRCLINE_APPS_RECONSTRUCT_BOX_PROBLEM_H_

#include <ceres/ceres.h>

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <vector>

#include "apps/reconstruct/fit_box.h"
#include "circline/refine/cost_functions.h"

namespace circline::apps {

// The unknowns and their blocks.
struct BoxState {
  Eigen::Quaterniond rotation;
  Eigen::Vector3d translation, length, skew = Eigen::Vector3d::Zero();
  std::array<double, kCameraSize> camera{};
};

// All but `state` outlive it; `state` is what it begins with and, solved, the solution.
class BoxProblem {
 public:
  // `edges`: which of the box's; `wear_px`: what all points of an edge share beside the noise
  // model's.
  BoxProblem(const Camera& camera, const BoxObservation& box, const BoxOptions& options,
             const std::vector<std::size_t>& edges, double wear_px, BoxState* state);

  bool Solve();
  double cost() const { return summary_.final_cost; }
  bool metric() const;
  // Root mean square of each edge's distances, pixels.
  std::vector<double> ResidualsPx() const;
  // Of [delta, delta_t, length] and of log f, with the inliers at full weight.
  bool Covariance(Eigen::Matrix<double, 9, 9>* covariance, double* focal_sigma);

 private:
  // As BoxEdgeCost has them.
  std::array<double*, 7> Blocks() const;
  void AddCamera();
  void AddEdge(const BoxEdge& edge);
  void AddLine(const FaceLine& line);
  void AddPriors();
  bool IsOfOneLine(const double* block) const;
  void SetWeighing(const Weighing& weighing);

  const Camera& camera_;
  const BoxObservation& box_;
  const BoxOptions& options_;
  double wear_px_;
  BoxState& state_;
  bool has_camera_ = false;
  ceres::Problem problem_;
  std::vector<FeatureCost*> edges_, lines_;                   // The problem owns them.
  Eigen::Matrix3d directions_ = Eigen::Matrix3d::Identity();  // Columns: of lines along each axis.
  std::vector<std::array<double, 2>> line_blocks_;            // As DirectionLineCost has them.
  ceres::Solver::Summary summary_;
};

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_RECONSTRUCT_BOX_PROBLEM_H_
