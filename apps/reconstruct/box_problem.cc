#include "apps/reconstruct/box_problem.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>

#include "apps/reconstruct/box_edge_cost.h"
#include "apps/reconstruct/box_start.h"

namespace circline::apps {

BoxProblem::BoxProblem(const Camera& camera, const BoxObservation& box, const BoxOptions& options,
                       const std::vector<std::size_t>& edges, double wear_px, BoxState* state)
    : camera_(camera), box_(box), options_(options), wear_px_(wear_px), state_(*state) {
  AddCamera();
  for (const std::size_t e : edges) AddEdge(box.edges[e]);
  line_blocks_.reserve(options.lines.size());  // Ceres keeps pointers into it.
  for (const FaceLine& line : options.lines) AddLine(line);
  AddPriors();
}

bool BoxProblem::Solve() {
  ceres::Solver::Options solver;
  solver.linear_solver_type = ceres::DENSE_QR;
  if (!lines_.empty()) {  // Each line's own unknowns are eliminated first.
    solver.linear_solver_type = ceres::DENSE_SCHUR;
    solver.linear_solver_ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    std::vector<double*> blocks;
    problem_.GetParameterBlocks(&blocks);
    for (double* block : blocks) {
      solver.linear_solver_ordering->AddElementToGroup(block, IsOfOneLine(block) ? 0 : 1);
    }
  }
  solver.logging_type = ceres::SILENT;
  solver.max_num_iterations = 100;
  for (const double stretch : {30.0, 5.0, 1.0}) {  // A start many sigmas off is no outlier.
    Weighing wide;
    wide.stretch = stretch;
    SetWeighing(wide);
    ceres::Solve(solver, &problem_, &summary_);
  }
  return summary_.IsSolutionUsable() && std::isfinite(summary_.final_cost);
}

bool BoxProblem::IsOfOneLine(const double* block) const {
  return std::any_of(line_blocks_.begin(), line_blocks_.end(),
                     [block](const auto& own) { return own.data() == block; });
}

void BoxProblem::SetWeighing(const Weighing& weighing) {
  for (const auto* costs : {&edges_, &lines_}) {
    for (FeatureCost* cost : *costs) cost->set_weighing(weighing);
  }
}

std::vector<double> BoxProblem::ResidualsPx() const {
  std::vector<double> residuals_px, distances;
  const std::array<double*, 7> blocks = Blocks();
  for (const FeatureCost* cost : edges_) {
    cost->Distances(blocks.data(), &distances);
    double sum = 0.0;
    for (const double d : distances) sum += d * d;
    residuals_px.push_back(std::sqrt(sum / static_cast<double>(distances.size())));
  }
  return residuals_px;
}

bool BoxProblem::Covariance(Eigen::Matrix<double, 9, 9>* covariance, double* focal_sigma) {
  Weighing inliers;
  inliers.inliers_only = true;
  SetWeighing(inliers);
  ceres::Covariance::Options how;
  how.algorithm_type = ceres::DENSE_SVD;
  how.null_space_rank = 0;
  ceres::Covariance solved(how);
  const std::array<double*, 7> all = Blocks();
  std::vector<const double*> blocks(all.begin(), all.begin() + 5);  // Pose and lengths.
  if (has_camera_) blocks.push_back(state_.camera.data());
  if (!solved.Compute(blocks, &problem_)) return false;
  if (has_camera_) {
    Eigen::Matrix<double, kCameraSize, kCameraSize, Eigen::RowMajor> camera;
    if (!solved.GetCovarianceBlock(blocks.back(), blocks.back(), camera.data())) return false;
    *focal_sigma = std::sqrt(camera(0, 0));
    blocks.pop_back();
  }
  const int turn = metric() ? 3 : 2;  // Tangent size of the translation.
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor> tangent(6 + turn,
                                                                                 6 + turn);
  if (!solved.GetCovarianceMatrixInTangentSpace(blocks, tangent.data())) return false;
  Eigen::MatrixXd out = Eigen::MatrixXd::Zero(9, 6 + turn);
  out.topLeftCorner<3, 3>() = 2.0 * Eigen::Matrix3d::Identity();  // Ceres counts half angles.
  out.bottomRightCorner<3, 3>().setIdentity();
  if (metric()) {
    out.block<3, 3>(3, 3).setIdentity();
  } else {
    Eigen::Matrix<double, 3, 2, Eigen::RowMajor> plus;
    ceres::SphereManifold<3>().PlusJacobian(state_.translation.data(), plus.data());
    out.block<3, 2>(3, 3) = plus;
  }
  *covariance = out * tangent * out.transpose();
  return covariance->allFinite();
}

bool BoxProblem::metric() const {
  return std::any_of(box_.length.begin(), box_.length.end(), [](double l) { return l > 0.0; });
}

std::array<double*, 7> BoxProblem::Blocks() const {
  return {state_.rotation.coeffs().data(),
          state_.translation.data(),
          &state_.length.x(),
          &state_.length.y(),
          &state_.length.z(),
          state_.skew.data(),
          state_.camera.data()};
}

void BoxProblem::AddCamera() {
  const CameraSigma& sigma = options_.camera;
  std::vector<double> sigmas(kCameraSize, 0.0);
  sigmas[0] = sigma.log_focal;
  sigmas[1] = sigma.log_aspect;
  sigmas[2] = sigmas[3] = sigma.principal_point_px;
  if (camera_.model != CameraModel::kPinhole) sigmas[4] = sigma.k1;
  std::vector<int> held;
  for (int k = 0; k < kCameraSize; ++k) {
    if (!(sigmas[static_cast<std::size_t>(k)] > 0.0)) held.push_back(k);
  }
  has_camera_ = held.size() < kCameraSize;
  if (!has_camera_) return;
  problem_.AddParameterBlock(state_.camera.data(), kCameraSize,
                             new ceres::SubsetManifold(kCameraSize, held));
  problem_.AddResidualBlock(NewGaussianPrior(sigmas), nullptr, state_.camera.data());
}

void BoxProblem::AddEdge(const BoxEdge& edge) {
  NoiseModel noise = options_.noise;
  const double shared = std::hypot(noise.line_px, std::hypot(wear_px_, edge.shared_px));
  noise.line_px = shared;
  // An edge bends as a whole.
  noise.correlation_px = std::numeric_limits<double>::max();
  ImagePoints::Options how;
  how.sigma_px = std::hypot(edge.sigma_px, shared);
  how.loss = LossType::kCauchy;
  how.weight = noise.LineWeight(edge.sigma_px, edge.points, {}) * how.sigma_px * how.sigma_px /
               (edge.sigma_px * edge.sigma_px);
  auto* cost =
      new BoxEdgeCost(ImagePoints(camera_, edge.points, {}, how), edge.axis, edge.far, has_camera_);
  edges_.push_back(cost);
  const std::array<double*, 7> all = Blocks();
  problem_.AddResidualBlock(cost, nullptr,
                            std::vector<double*>(all.begin(), all.end() - (has_camera_ ? 0 : 1)));
}

// As EstimatePose has the lines of a pencil.
void BoxProblem::AddLine(const FaceLine& line) {
  const NoiseModel& noise = options_.noise;
  Eigen::Vector3d plane;
  if (!PlaneOfPoints(camera_, line.points, &plane)) return;
  ImagePoints::Options how;
  how.sigma_px = line.sigma_px;
  how.loss = LossType::kCauchy;
  how.weight = noise.LineWeight(line.sigma_px, line.points, {});
  DirectionLineCost::Options options;
  options.direction_sigma = noise.line_direction_rad;
  options.camera = has_camera_;
  auto* cost = new DirectionLineCost(ImagePoints(camera_, line.points, {}, how), plane, options);
  double* const direction = directions_.col(line.axis).data();
  line_blocks_.push_back({0.0, 0.0});
  std::vector<double*> blocks = {state_.rotation.coeffs().data(), direction,
                                 line_blocks_.back().data()};
  if (has_camera_) blocks.push_back(state_.camera.data());
  cost->Start(blocks.data(), line_blocks_.back().data());
  lines_.push_back(cost);
  const bool is_first = !problem_.HasParameterBlock(direction);
  problem_.AddResidualBlock(cost, nullptr, blocks);
  if (!is_first) return;
  const double axis_sigma = noise.pencil_axis_rad;
  if (axis_sigma > 0.0) {
    problem_.SetManifold(direction, new ceres::SphereManifold<3>);
    problem_.AddResidualBlock(NewDirectionPrior(Eigen::Vector3d::Unit(line.axis), axis_sigma),
                              nullptr, direction);
  } else {
    problem_.SetParameterBlockConstant(direction);
  }
}

void BoxProblem::AddPriors() {
  problem_.SetManifold(state_.rotation.coeffs().data(), new ceres::EigenQuaternionManifold);
  if (!metric()) problem_.SetManifold(state_.translation.data(), new ceres::SphereManifold<3>);
  const double relative = box_.length_sigma > 0.0 ? box_.length_sigma : options_.noise.length;
  for (int k = 0; k < 3; ++k) {
    const double known = box_.length[static_cast<std::size_t>(k)];
    if (!(known > 0.0)) continue;
    if (relative > 0.0) {
      problem_.AddResidualBlock(NewLogPrior(known, relative), nullptr, &state_.length[k]);
    } else {
      state_.length[k] = known;
      problem_.SetParameterBlockConstant(&state_.length[k]);
    }
  }
  const double axis_sigma = options_.noise.pencil_axis_rad;
  if (axis_sigma > 0.0) {
    problem_.AddResidualBlock(NewGaussianPrior({axis_sigma, axis_sigma, axis_sigma}), nullptr,
                              state_.skew.data());
  } else {
    problem_.SetParameterBlockConstant(state_.skew.data());
  }
}

}  // namespace circline::apps
