// Many photos: solved and judged, and how well cameras and poses are known.
#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdint>

#include "circline/refine/block_chain.h"
#include "circline/refine/joint/linearization.h"
#include "circline/refine/many/adjust_problem.h"
#include "circline/refine/nearby_solve.h"

namespace circline {
namespace {

// Why no feature takes part.
Status NothingActive(const std::vector<AdjustInput>& photos) {
  const bool is_any_left = std::any_of(photos.begin(), photos.end(),
                                       [](const AdjustInput& photo) { return photo.takes_part; });
  return Status::Refused(
      is_any_left ? "the photos have led to a camera through which none of their circles and lines "
                    "can be placed: a better focal length to start from is missing"
                  : "the photos contradict each other: each has been left out");
}

}  // namespace

std::vector<const Term*> AdjustProblem::ActiveTerms(std::size_t end) const {
  std::vector<const Term*> active;
  for (const Feature& feature : features_) {
    if (!feature.active || feature.photo >= end) continue;
    active.push_back(&term(feature.term));
    if (feature.grid_term >= 0) active.push_back(&term(feature.grid_term));
  }
  std::vector<std::uint8_t> is_used(blocks().size(), 0);
  for (const int block : BlocksOf(active)) is_used[static_cast<std::size_t>(block)] = 1;
  for (const int block : lattice_frames_) is_used[static_cast<std::size_t>(block)] = 1;
  for (const int block : given_) is_used[static_cast<std::size_t>(block)] = 1;
  for (const Term& prior : terms()) {
    if (prior.feature < 0 && std::all_of(prior.blocks.begin(), prior.blocks.end(), [&](int block) {
          return is_used[static_cast<std::size_t>(block)] != 0;
        }))
      active.push_back(&prior);
  }
  return active;
}

Status AdjustProblem::Solve(double stretch, int max_iterations) {
  Weighing weighing;
  weighing.stretch = stretch;
  const std::vector<const Term*> active = ActiveTerms();
  if (active.empty()) return NothingActive(photos_);
  SetWeighing(weighing);
  ceres::Problem problem(OwnsNothing());
  Fill(active, Values(0), &problem);
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::SPARSE_NORMAL_CHOLESKY;
  options.max_num_iterations = max_iterations;
  options.num_threads = options_.num_solver_threads;
  options.logging_type = ceres::SILENT;
  options.function_tolerance = 1e-8;
  options.parameter_tolerance = 1e-9;
  options.initial_trust_region_radius = 1e5;
  options.max_trust_region_radius = 1e8;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  SetWeighing(Weighing());
  return summary.IsSolutionUsable()
             ? Status::Ok()
             : Status::Failed("the photos cannot be evaluated at where they start");
}

void AdjustProblem::Judge() {
  const double* parameters[kMostBlocks];
  for (Feature& feature : features_) {
    const Term& term = this->term(feature.term);
    const int rows = term.cost->num_residuals();
    Eigen::VectorXd residuals(rows);
    std::vector<RowMajor> jacobians;
    std::vector<double*> pointers;
    for (const int size : term.cost->parameter_block_sizes())
      pointers.push_back(jacobians.emplace_back(rows, size).data());
    feature.chi2 = 0.0;
    feature.rows = 0;
    Parameters(term, values().data(), parameters);
    if (!term.cost->Evaluate(parameters, residuals.data(), pointers.data())) continue;
    for (int row = 0; row < rows; ++row) {
      // The row without derivative is what no curve explains: the noise of the points.
      if (std::all_of(jacobians.begin(), jacobians.end(),
                      [row](const RowMajor& J) { return J.row(row).isZero(0.0); }))
        continue;
      feature.chi2 += residuals[row] * residuals[row];
      ++feature.rows;
    }
  }
}

double AdjustProblem::Misfit() const {
  double chi2 = 0.0;
  int rows = 0, unknowns = 0;
  const std::vector<const Term*> active = ActiveTerms();
  for (const Term* term : active) {
    if (term->feature >= 0) {
      chi2 += features_[static_cast<std::size_t>(term->feature)].chi2;
      rows += features_[static_cast<std::size_t>(term->feature)].rows;
      continue;
    }
    const double* parameters[kMostBlocks];
    Parameters(*term, values().data(), parameters);
    const double own = TwiceCostOf(*term->cost, nullptr, Weighing(), parameters);
    if (!std::isfinite(own)) continue;
    chi2 += own;
    rows += term->cost->num_residuals();
  }
  for (const int block : BlocksOf(active)) unknowns += this->block(block).tangent_size();
  return rows > unknowns ? chi2 / (rows - unknowns) : 1.0;
}

std::vector<AdjustInput>::const_iterator AdjustProblem::FirstOf(std::size_t camera) const {
  return std::find_if(photos_.begin(), photos_.end(), [&](const AdjustInput& photo) {
    return photo.camera == camera && photo.takes_part;
  });
}

Camera AdjustProblem::CameraAt(std::size_t camera) const {
  return ShiftedCamera(FirstOf(camera)->observations->camera, Values(cameras_[camera]));
}

CameraPose AdjustProblem::PoseAt(std::size_t photo) const {
  return {RotationFromBlock(Values(rotations_[photo])),
          Eigen::Vector3d(Values(translations_[photo]))};
}

Matrix6d AdjustProblem::PoseCovariance(std::size_t photo, const Linearization& at) const {
  Eigen::Matrix<double, 6, 4> turn = Eigen::Matrix<double, 6, 4>::Zero();
  Eigen::Matrix<double, 6, 3> shift = Eigen::Matrix<double, 6, 3>::Zero();
  // The block turns the world: exp([R d]x) R = R exp([d]x).
  turn.topRows<3>() = PoseAt(photo).rotation * DeltaFromQuaternion(Values(rotations_[photo]));
  shift.bottomRows<3>().setIdentity();
  return at.Covariance({{rotations_[photo], turn}, {translations_[photo], shift}});
}

AdjustProblem::Covariances AdjustProblem::Covariance(std::size_t end, bool at_minimum) const {
  Weighing inliers;
  inliers.inliers_only = true;
  constexpr double kTiny = 1e-10;  // What nothing ties (one circle's spin) says nothing.
  Linearization::Options options;
  options.floor = kTiny;
  options.at_minimum = at_minimum;
  Linearization at(*this, ActiveTerms(end), values().data(), inliers, options);
  Covariances out;
  for (const CameraPrior& prior : priors_) {
    const Eigen::Map<const Eigen::Array<double, kCameraSize, 1>> sigma(prior.sigma.data());
    out.cameras.emplace_back(sigma.square().matrix().asDiagonal());
  }
  out.poses.assign(photos_.size(), Matrix6d::Zero());
  if (!at.ComputeCovariance()) return out;
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    if (at.column(cameras_[c]) >= 0)
      out.cameras[c] =
          at.Covariance({{cameras_[c], Eigen::MatrixXd::Identity(kCameraSize, kCameraSize)}});
  }
  if (!given_.empty()) out.log_scale = at.Covariance(at.Columns(given_[2])).trace();
  for (std::size_t i = 0; i < photos_.size(); ++i) {
    if (rotations_[i] >= 0 && i < end) out.poses[i] = PoseCovariance(i, at);
  }
  return out;
}

namespace {

// Unit vectors across a curve at its points: away from the middle of a contour's, to one side of a
// line's, as its first and last point have it.
std::vector<Eigen::Vector2d> Across(const std::vector<Eigen::Vector2d>& pixels, bool is_line) {
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& p : pixels) middle += p / static_cast<double>(pixels.size());
  const Eigen::Vector2d along = (pixels.back() - pixels.front()).normalized();
  std::vector<Eigen::Vector2d> across;
  for (const Eigen::Vector2d& p : pixels)
    across.push_back(is_line ? Eigen::Vector2d(-along.y(), along.x()) : (p - middle).normalized());
  return across;
}

}  // namespace

std::vector<std::vector<AdjustedResidual>> AdjustProblem::Residuals() const {
  std::vector<std::vector<AdjustedResidual>> out(photos_.size());
  std::vector<double> distances;
  const double* parameters[kMostBlocks];
  for (const Feature& feature : features_) {
    const Term& term = this->term(feature.term);
    const ImagePoints* points = term.weighed->points();
    if (!feature.active || points == nullptr) continue;
    Parameters(term, values().data(), parameters);
    term.weighed->Distances(parameters, &distances);
    const bool is_line = dynamic_cast<const DirectionLineCost*>(term.weighed) != nullptr;
    const std::vector<Eigen::Vector2d> across = Across(points->pixels(), is_line);
    const double gate = kInlierSigmas * points->options().sigma_px;
    for (std::size_t i = 0; i < distances.size(); ++i) {
      if (std::abs(distances[i]) <= gate)
        out[feature.photo].push_back({points->pixels()[i], distances[i] * across[i]});
    }
  }
  return out;
}

std::vector<AdjustedDirection> AdjustProblem::Directions() const {
  std::vector<AdjustedDirection> out;
  for (const auto& [key, direction] : directions_)
    out.push_back({key.second, direction.photo, Eigen::Vector3d(Values(direction.block))});
  return out;
}

GivenFrame AdjustProblem::GivenFrameAt() const {
  return {std::exp(*Values(given_[2])), RotationFromBlock(Values(given_[0])),
          Eigen::Vector3d(Values(given_[1]))};
}

std::vector<AdjustedCircle> AdjustProblem::Circles() const {
  std::vector<AdjustedCircle> out;
  for (const auto& [key, circle] : circles_) {
    const PlaneCircle at(Values(circle.center), *Values(circle.radius),
                         circle.tilt >= 0 ? Values(circle.tilt) : nullptr);
    out.push_back({key.second, static_cast<int>(key.first) - 1, at.center, at.normal.normalized(),
                   at.radius});
  }
  return out;
}

}  // namespace circline
