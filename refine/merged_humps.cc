#include "circline/refine/merged_humps.h"

#include <Eigen/Dense>
#include <algorithm>
#include <utility>

namespace circline {
namespace {

// What takes one pose to another: [delta, delta_t] (PoseHypothesis::covariance); of a rotation that
// is free about the normal, the normal's turn.
Vector6d StepBetween(const PoseHypothesis& from, const PoseHypothesis& to) {
  const Eigen::Matrix3d &A = to.cam_from_world.rotation, &B = from.cam_from_world.rotation;
  Vector6d step;
  step << (from.RotationIsFree() ? B.col(2).cross(A.col(2)) : LogRotation(A * B.transpose())),
      to.cam_from_world.translation - from.cam_from_world.translation;
  return step;
}

// Whether two hypotheses are humps of one, less apart than they are wide: of a bent page, say,
// whose lines agree with one of two directions, with a feature or without. The two poses of a lone
// circle are two, however near.
bool AreHumpsOfOne(const PoseHypothesis& a, const PoseHypothesis& b) {
  constexpr double kApart2 = 4.0;  // Squared, standard deviations of their difference.
  if (a.RotationIsFree() && a.structure == b.structure) return false;
  if (a.metric != b.metric || a.free_directions.size() != b.free_directions.size()) return false;
  const double scale = a.focal_scale - b.focal_scale;
  const Vector6d step = StepBetween(a, b).cwiseAbs2(),
                 variance = a.Covariance().diagonal() + b.Covariance().diagonal();
  return (step.head<3>().array() <= kApart2 * variance.head<3>().array()).all() &&
         step.tail<3>().sum() <= kApart2 * variance.tail<3>().sum() &&
         scale * scale <= kApart2 * (a.focal_sigma * a.focal_sigma + b.focal_sigma * b.focal_sigma);
}

}  // namespace

void MergeHumps(std::vector<PoseHypothesis>* hypotheses) {
  std::vector<PoseHypothesis> merged;
  double most = 0.0;
  for (PoseHypothesis& h : *hypotheses) {
    const auto one = std::find_if(merged.begin(), merged.end(),
                                  [&](const PoseHypothesis& m) { return AreHumpsOfOne(m, h); });
    if (one == merged.end()) {
      most = std::max(most, h.probability);
      merged.push_back(std::move(h));
      continue;
    }
    if (h.cost < one->cost) std::swap(h, *one);
    const Vector6d step = StepBetween(*one, h);
    const double all = one->probability + h.probability;
    SetCovariance((one->probability * one->Covariance() +
                   h.probability * (h.Covariance() + step * step.transpose())) /
                      all,
                  &*one);
    one->probability = std::min(1.0, all);  // Rounding may exceed it.
    most = std::max(most, one->probability);
  }
  // Ties keep their order (RankHypotheses).
  constexpr double kTie = 1.1;
  std::stable_sort(merged.begin(), merged.end(),
                   [most](const PoseHypothesis& a, const PoseHypothesis& b) {
                     const bool ta = kTie * a.probability > most, tb = kTie * b.probability > most;
                     return ta != tb ? ta : !ta && a.probability > b.probability;
                   });
  *hypotheses = std::move(merged);
}

}  // namespace circline
