// Many photos: solved and judged.
#include <ceres/ceres.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "circline/refine/adjust_problem.h"
#include "circline/refine/block_chain.h"
#include "circline/refine/nearby_solve.h"

namespace circline {

// Whether features that take part have its blocks.
bool AdjustProblem::IsOf(const Prior& prior, const ceres::Problem& problem) {
  return std::all_of(prior.blocks.begin(), prior.blocks.end(),
                     [&](double* values) { return problem.HasParameterBlock(values); });
}

void AdjustProblem::Fill(const std::vector<const ceres::Manifold*>& cameras, int end,
                         ceres::Problem* problem) const {
  const auto add = [&](const std::vector<double*>& blocks) {
    for (double* values : blocks) {
      if (problem->HasParameterBlock(values)) continue;
      const Block& block = blocks_.at(values);
      problem->AddParameterBlock(values, block.size, const_cast<ceres::Manifold*>(block.manifold));
      if (block.constant) problem->SetParameterBlockConstant(values);
    }
  };
  for (const Feature& feature : features_) {
    if (!feature.active || feature.photo >= end) continue;
    add(feature.blocks);
    problem->AddResidualBlock(feature.cost, nullptr, feature.blocks);
  }
  add(given_);
  for (const Prior& prior : priors_) {
    if (IsOf(prior, *problem))
      problem->AddResidualBlock(prior.cost.get(), prior.loss.get(), prior.blocks);
  }
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    if (!problem->HasParameterBlock(cameras_[i])) continue;
    if (cameras[i] == nullptr) {
      problem->SetParameterBlockConstant(cameras_[i]);
    } else {
      problem->SetManifold(cameras_[i], const_cast<ceres::Manifold*>(cameras[i]));
    }
  }
}

Status AdjustProblem::Solve(double stretch, bool coarse, int max_iterations) {
  Weighing weighing;
  weighing.stretch = stretch;
  for (const Feature& feature : features_) feature.cost->set_weighing(weighing);
  ceres::Problem problem(OwnsNothing());
  Fill(coarse ? coarse_free_ : all_free_, static_cast<int>(photos_.size()), &problem);
  if (problem.NumResidualBlocks() == 0)
    return Status::Refused("no photo has evidence in its plane");
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
  for (const Feature& feature : features_) feature.cost->set_weighing(Weighing());
  return summary.IsSolutionUsable()
             ? Status::Ok()
             : Status::Failed("the photos cannot be evaluated at where they start");
}

double AdjustProblem::LargestMiss() const {
  double most = 0.0;
  for (const Feature& feature : features_) {
    const double square = feature.active ? MeanSquareOf(*feature.cost, feature.blocks.data()) : 0.0;
    if (std::isfinite(square)) most = std::max(most, square);
  }
  return std::sqrt(most);
}

void AdjustProblem::Judge() {
  for (Feature& feature : features_) {
    const auto rows = static_cast<std::size_t>(feature.cost->num_residuals());
    std::vector<double> residuals(rows);
    std::vector<std::vector<double>> jacobians;
    std::vector<double*> pointers;
    for (const double* block : feature.blocks) {
      const auto size = static_cast<std::size_t>(blocks_.at(const_cast<double*>(block)).size);
      jacobians.emplace_back(rows * size);
    }
    for (std::vector<double>& jacobian : jacobians) pointers.push_back(jacobian.data());
    feature.chi2 = 0.0;
    feature.rows = 0;
    if (!feature.cost->Evaluate(feature.blocks.data(), residuals.data(), pointers.data())) continue;
    // The row without derivative is what no curve explains: the noise of the points.
    for (std::size_t row = 0; row < rows; ++row) {
      bool is_rest = true;
      for (std::size_t b = 0; b < jacobians.size() && is_rest; ++b) {
        const std::size_t size = jacobians[b].size() / rows;
        is_rest = std::all_of(jacobians[b].begin() + static_cast<std::ptrdiff_t>(row * size),
                              jacobians[b].begin() + static_cast<std::ptrdiff_t>((row + 1) * size),
                              [](double d) { return d == 0.0; });
      }
      if (is_rest) continue;
      feature.chi2 += residuals[row] * residuals[row];
      ++feature.rows;
    }
  }
}

double AdjustProblem::Misfit() const {
  ceres::Problem problem(OwnsNothing());
  Fill(all_free_, static_cast<int>(photos_.size()), &problem);
  double chi2 = 0.0;
  int rows = 0, unknowns = 0;
  for (const Feature& feature : features_) {
    if (!feature.active) continue;
    chi2 += feature.chi2;
    rows += feature.rows;
  }
  for (const Prior& prior : priors_) {
    if (!IsOf(prior, problem)) continue;
    const double own = TwiceCostOf(*prior.cost, nullptr, Weighing(), prior.blocks.data());
    if (!std::isfinite(own)) continue;
    chi2 += own;
    rows += prior.cost->num_residuals();
  }
  std::vector<double*> all;
  problem.GetParameterBlocks(&all);
  for (double* values : all) {
    if (!problem.IsParameterBlockConstant(values))
      unknowns += problem.ParameterBlockTangentSize(values);
  }
  return rows > unknowns ? chi2 / (rows - unknowns) : 1.0;
}

bool AdjustProblem::IsUsed(int camera) const {
  return std::any_of(photos_.begin(), photos_.end(), [&](const AdjustInput& photo) {
    return photo.camera == camera && photo.takes_part;
  });
}

Camera AdjustProblem::CameraAt(int camera) const {
  const auto member = std::find_if(photos_.begin(), photos_.end(), [&](const AdjustInput& photo) {
    return photo.camera == camera && photo.takes_part;
  });
  return ShiftedCamera(member->observations->camera, cameras_[static_cast<std::size_t>(camera)]);
}

CameraPose AdjustProblem::PoseAt(int photo) const {
  const auto i = static_cast<std::size_t>(photo);
  return {RotationFromBlock(rotations_[i]), Eigen::Vector3d(translations_[i])};
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
  for (const Feature& feature : features_) {
    const ImagePoints* points = feature.cost->points();
    if (!feature.active || points == nullptr) continue;
    feature.cost->Distances(feature.blocks.data(), &distances);
    const bool is_line = dynamic_cast<const DirectionLineCost*>(feature.cost) != nullptr;
    const std::vector<Eigen::Vector2d> across = Across(points->pixels(), is_line);
    const double gate = kInlierSigmas * points->options().sigma_px;
    for (std::size_t i = 0; i < distances.size(); ++i) {
      if (std::abs(distances[i]) <= gate)
        out[static_cast<std::size_t>(feature.photo)].push_back(
            {points->pixels()[i], distances[i] * across[i]});
    }
  }
  return out;
}

std::vector<AdjustedDirection> AdjustProblem::Directions() const {
  std::vector<AdjustedDirection> out;
  for (const auto& [key, direction] : directions_)
    out.push_back({key.second, direction.photo, Eigen::Vector3d(direction.block)});
  return out;
}

GivenFrame AdjustProblem::GivenFrameAt() const {
  return {std::exp(*given_[2]), RotationFromBlock(given_[0]), Eigen::Vector3d(given_[1])};
}

std::vector<AdjustedCircle> AdjustProblem::Circles() const {
  std::vector<AdjustedCircle> out;
  for (const auto& [key, circle] : circles_) {
    const PlaneCircle at(circle.center, *circle.radius, circle.tilt);
    out.push_back({circle.id, key.first - 1, at.center, at.normal.normalized(), at.radius});
  }
  return out;
}

}  // namespace circline
