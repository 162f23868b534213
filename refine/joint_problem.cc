#include "circline/refine/joint_problem.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "circline/refine/block_chain.h"

namespace circline {

BlockMatrix PlusJacobianOf(const ceres::Manifold& manifold, const double* at) {
  Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, kCameraSize, kCameraSize>
      J(manifold.AmbientSize(), manifold.TangentSize());
  manifold.PlusJacobian(at, J.data());
  return J;
}

std::vector<std::uint8_t> JointProblem::FirstReading() const {
  std::vector<std::uint8_t> reading(features_.size(), 1);
  for (std::size_t i = 0; i < features_.size(); ++i) {
    const Feature& f = features_[i];
    if (f.kind != Feature::Kind::kLine || f.line < 0) continue;
    reading[i] = observations_.pencils[static_cast<std::size_t>(f.observation)]
                         .lines[static_cast<std::size_t>(f.line)]
                         .is_parallel
                     ? 1
                     : 0;
  }
  return reading;
}

bool JointProblem::IsActive(const Term& term, const State& state) const {
  for (int f = term.feature; f >= 0; f = feature(f).parent) {
    if (!state.Has(f)) return false;
  }
  return true;
}

void JointProblem::SeeThrough(const State& state) const {
  const double* camera = At(kCamera, state);
  for (const Term& term : terms_) {
    if (camera_is_estimated_ && term.weighed != nullptr && IsActive(term, state))
      term.weighed->SeeThrough(camera);
  }
}

void JointProblem::Parameters(const Term& term, const State& state, const double** out) const {
  for (std::size_t k = 0; k < term.blocks.size(); ++k) out[k] = At(term.blocks[k], state);
}

bool JointProblem::IsMetric(const State& state) const {
  const auto is_active = [&](int f) { return state.Has(f); };
  return std::any_of(circles_.begin(), circles_.end(),
                     [&](const CircleBlocks& c) {
                       return is_active(c.feature) && ObservationOf(c).radius > 0.0;
                     }) ||
         std::any_of(lengths_.begin(), lengths_.end(),
                     [&](const LengthBlocks& l) { return is_active(l.feature); });
}

bool JointProblem::OriginIsPlaced(const State& state) const {
  if (center_at_origin_ < 0) return origin_observed_;
  const int block = circles_[static_cast<std::size_t>(center_at_origin_)].center;
  return observations_.frame.origin ||
         std::any_of(circles_.begin(), circles_.end(), [&](const CircleBlocks& c) {
           return c.center == block && state.Has(c.feature);
         });
}

double JointProblem::TwiceCost(const Term& term, const State& state,
                               const Weighing& weighing) const {
  const double* parameters[8];
  Parameters(term, state, parameters);
  double rho[3] = {TwiceCostOf(*term.cost, term.weighed, weighing, parameters), 0.0, 0.0};
  if (term.loss != nullptr && std::isfinite(rho[0])) term.loss->Evaluate(rho[0], rho);
  return rho[0];
}

double JointProblem::FreeCost(const State& state) const {
  double twice_cost = 0.0;
  for (std::size_t i = 0; i < features_.size(); ++i)
    twice_cost += state.active[i] != 0 ? features_[i].free_twice_cost : 0.0;
  return 0.5 * twice_cost;
}

double JointProblem::Cost(const State& state, const Weighing& weighing) const {
  double cost = 0.0;
  for (const Term& term : terms_) {
    if (IsActive(term, state)) cost += 0.5 * TwiceCost(term, state, weighing);
  }
  return std::isfinite(cost) ? cost : std::numeric_limits<double>::infinity();
}

CameraPose JointProblem::PoseAt(const State& state) const {
  CameraPose pose;
  pose.rotation = RotationFromBlock(At(kRotation, state));
  pose.translation = Eigen::Map<const Eigen::Vector3d>(At(kTranslation, state));
  return pose;
}

}  // namespace circline