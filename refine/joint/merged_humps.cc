#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "circline/refine/joint/readings.h"

namespace circline {
namespace {

// What takes one pose to another: [delta, delta_t] (PoseHypothesis::covariance); of a rotation that
// is free about the normal, the normal's turn; of a translation that is a convention, nothing.
Vector6d StepBetween(const PoseHypothesis& from, const PoseHypothesis& to) {
  const Eigen::Matrix3d &A = to.cam_from_world.rotation, &B = from.cam_from_world.rotation;
  Vector6d step;
  step << (from.RotationIsFree() ? B.col(2).cross(A.col(2)) : LogRotation(A * B.transpose())),
      to.cam_from_world.translation - from.cam_from_world.translation;
  const auto is_convention = [](const PoseHypothesis& h) {
    return h.Covariance().diagonal().tail<3>().isZero(0.0);
  };
  if (is_convention(from) && is_convention(to)) step.tail<3>().setZero();
  return step;
}

// Whether two hypotheses are humps of one, less apart than they are wide: of a bent page, say,
// whose lines agree with one of two directions, with a feature or without. The two poses of a lone
// circle are two, however near.
bool AreHumpsOfOne(const PoseHypothesis& a, const PoseHypothesis& b) {
  constexpr double kApart2 = 4.0;  // Squared, standard deviations of their difference.
  const bool of_one_circle = a.RotationIsFree() && a.circles.size() < 2;
  if (of_one_circle && a.structure == b.structure) return false;
  if (a.metric != b.metric || a.free_directions.size() != b.free_directions.size()) return false;
  const double scale = a.focal_scale - b.focal_scale;
  const Vector6d step = StepBetween(a, b).cwiseAbs2(),
                 variance = a.Covariance().diagonal() + b.Covariance().diagonal();
  return (step.head<3>().array() <= kApart2 * variance.head<3>().array()).all() &&
         step.tail<3>().sum() <= kApart2 * variance.tail<3>().sum() &&
         scale * scale <= kApart2 * (a.focal_sigma * a.focal_sigma + b.focal_sigma * b.focal_sigma);
}

// Leaves out what has no variance in the covariance of a hypothesis: free directions, and the
// length of t where that is a direction.
Matrix6d OntoKnown(const PoseHypothesis& h) {
  Matrix6d onto = Matrix6d::Identity();
  const auto leave_out = [&onto](const Vector6d& v) { onto -= v * (v.transpose() * onto).eval(); };
  for (const std::array<double, 6>& direction : h.free_directions)
    leave_out(Eigen::Map<const Vector6d>(direction.data()));
  Vector6d length = Vector6d::Zero();
  length.tail<3>() = h.cam_from_world.translation;
  if (!h.metric) leave_out(length);
  return onto;
}

// The covariances of `one`, about it, where `other` is the truth with a probability of `share`.
void Mix(double share, const PoseHypothesis& other, PoseHypothesis* one) {
  const Vector6d step = StepBetween(*one, other);
  const double scale = other.focal_scale - one->focal_scale;
  const auto mixed = [&](const auto& a, const auto& b) { return (1.0 - share) * a + share * b; };
  // What is free, or no variable, of the one need not be of the other, whose axes are turned.
  const Matrix6d onto = OntoKnown(*one);
  const Matrix6d covariance =
      mixed(one->Covariance(), Matrix6d(other.Covariance() + step * step.transpose()));
  SetCovariance(onto * covariance * onto.transpose(), one, one->metric ? 6 : 5);
  Eigen::Map<Vector6d> across(one->focal_covariance.data());
  across =
      onto *
      mixed(Vector6d(across),
            Vector6d(Eigen::Map<const Vector6d>(other.focal_covariance.data()) + scale * step));
  one->focal_sigma = std::sqrt(mixed(one->focal_sigma * one->focal_sigma,
                                     other.focal_sigma * other.focal_sigma + scale * scale));
}

}  // namespace

void MergeHumps(std::vector<PoseHypothesis>* hypotheses) {
  const auto log_posterior = [](const PoseHypothesis& h) { return -h.cost + 0.5 * h.log_det; };
  std::vector<PoseHypothesis> merged;
  for (PoseHypothesis& h : *hypotheses) {
    const auto one = std::find_if(merged.begin(), merged.end(),
                                  [&](const PoseHypothesis& m) { return AreHumpsOfOne(m, h); });
    if (one == merged.end()) {
      merged.push_back(std::move(h));
      continue;
    }
    const double log_odds = log_posterior(h) - log_posterior(*one),
                 share = 1.0 / (1.0 + std::exp(-log_odds));
    Mix(share, h, &*one);
    // Twice log(1 + odds), without overflow.
    one->log_det += 2.0 * (std::max(log_odds, 0.0) + std::log1p(std::exp(-std::abs(log_odds))));
  }
  *hypotheses = std::move(merged);
  RankHypotheses(hypotheses);
}

}  // namespace circline
