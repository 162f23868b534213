#include "circline/refine/joint/joint_problem.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "circline/refine/block_chain.h"

namespace circline {

Reading JointProblem::FirstReading() const {
  Reading reading(features_.size(), 1);
  for (std::size_t i = 0; i < features_.size(); ++i) {
    const Feature& f = features_[i];
    if (f.kind == Feature::Kind::kLine && f.line >= 0) reading[i] = LineOf(f).is_parallel ? 1 : 0;
  }
  return reading;
}

bool JointProblem::TakesPart(std::size_t i, const Reading& reading) const {
  for (int f = static_cast<int>(i); f >= 0; f = feature(f).parent) {
    if (reading[static_cast<std::size_t>(f)] == 0) return false;
  }
  return true;
}

bool JointProblem::IsSameReading(const Reading& a, const Reading& b) const {
  for (std::size_t i = 0; i < features_.size(); ++i) {
    if (TakesPart(i, a) != TakesPart(i, b)) return false;
  }
  return true;
}

bool JointProblem::IsActive(const Term& term, const State& state) const {
  return term.feature < 0 || TakesPart(static_cast<std::size_t>(term.feature), state.active);
}

std::vector<const Term*> JointProblem::ActiveTerms(const State& state) const {
  std::vector<const Term*> active;
  for (const Term& term : terms()) {
    if (IsActive(term, state)) active.push_back(&term);
  }
  return active;
}

void JointProblem::SeeThrough(const State& state) const {
  if (!camera_is_estimated_) return;
  for (const Term* term : ActiveTerms(state)) {
    if (term->weighed != nullptr) term->weighed->SeeThrough(At(kCamera, state));
  }
}

bool JointProblem::IsMetric(const State& state) const {
  return std::any_of(circles_.begin(), circles_.end(),
                     [&](const CircleBlocks& c) {
                       return state.Has(c.feature) && ObservationOf(c).radius > 0.0;
                     }) ||
         std::any_of(lengths_.begin(), lengths_.end(),
                     [&](const LengthBlocks& l) { return state.Has(l.feature); });
}

bool JointProblem::OriginIsPlaced(const State& state) const {
  if (center_at_origin_ < 0) return origin_observed_;
  const int block = circles_[static_cast<std::size_t>(center_at_origin_)].center;
  return observations_.frame.origin ||
         std::any_of(circles_.begin(), circles_.end(), [&](const CircleBlocks& c) {
           return c.center == block && state.Has(c.feature);
         });
}

bool JointProblem::SpinIsFree(const State& state) const {
  return !x_is_seen_ && std::none_of(pose_priors_.begin(), pose_priors_.end(), [&](const auto& p) {
    return p.tells_spin && IsActive(term(p.term), state);
  });
}

bool JointProblem::IsOnePencil(const State& state) const {
  std::set<int> pencils;
  for (const LineBlocks& l : lines_) {
    if (state.Has(l.feature)) pencils.insert(feature(l.feature).observation);
  }
  const auto takes_part = [&](const auto& blocks) { return IsActive(term(blocks.term), state); };
  return pencils.size() < 2 && std::none_of(circles_.begin(), circles_.end(), takes_part) &&
         std::none_of(pose_priors_.begin(), pose_priors_.end(), takes_part);
}

double JointProblem::FreeCost(const State& state) const {
  double twice_cost = 0.0;
  for (std::size_t i = 0; i < features_.size(); ++i)
    twice_cost += TakesPart(i, state.active) ? features_[i].free_twice_cost : 0.0;
  return 0.5 * twice_cost;
}

double JointProblem::Cost(const State& state) const {
  double cost = 0.0;
  for (const Term* term : ActiveTerms(state)) cost += 0.5 * TwiceCost(*term, state.x.data());
  return std::isfinite(cost) ? cost : std::numeric_limits<double>::infinity();
}

CameraPose JointProblem::PoseAt(const State& state) const {
  return {RotationFromBlock(At(kRotation, state)), Eigen::Vector3d(At(kTranslation, state))};
}

}  // namespace circline