#include "circline/refine/focal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "circline/estimators/pose.h"
#include "circline/refine/covariance.h"
#include "circline/refine/graduated.h"
#include "circline/refine/minimize.h"

namespace circline {
namespace {

constexpr double kStep = 1e-5;  // Of log_focal, for differences: a hundredth of a pixel.

Camera Refocused(const Camera& camera, double log_focal) {
  Camera result = camera;
  result.fx *= std::exp(log_focal);
  result.fy *= std::exp(log_focal);
  return result;
}

// The calibrated point of the pixel that `from` sees at x, as `to` sees it; false where it cannot.
bool Refocus(const Camera& from, const Camera& to, const Eigen::Vector2d& x,
             CalibratedPoint* point) {
  Eigen::Vector2d pixel;
  std::array<double, 4> unused;
  DistortWithJacobian(from, x, &pixel, &unused);
  return PixelToCalibrated(to, pixel, point);
}

// The same for all points of a set, which keeps its own coordinates.
bool Refocus(const Camera& from, const Camera& to, PointSet* set) {
  for (CalibratedPoint& p : set->points) {
    if (!Refocus(from, to, set->scale * p.x + set->shift, &p)) return false;
    p.x = (p.x - set->shift) / set->scale;
    for (double& v : p.x_from_pixel) v /= set->scale;
  }
  if (set->scatter) set->Compress();
  return true;
}

// The points whose flag is 0 go.
void KeepFlagged(const std::vector<std::uint8_t>& flags, std::vector<CalibratedPoint>* points) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < points->size() && i < flags.size(); ++i) {
    if (flags[i] != 0) (*points)[kept++] = (*points)[i];
  }
  points->resize(kept);
}

// How every unknown follows where the shared ones do, from the models a step below and above.
Values Follow(const JointEvidence& e, const SharedColumns& columns, const Eigen::VectorXd& shared,
              const ReducedModel& below, const ReducedModel& above) {
  Values by_block(e.parameters.size(), {0.0, 0.0, 0.0});
  for (std::size_t i = 0; i < by_block.size(); ++i) {
    if (columns.offsets[i] < 0) continue;
    for (int k = 0; k < e.parameters[i].size; ++k)
      by_block[i][static_cast<std::size_t>(k)] = shared[columns.offsets[i] + k];
  }
  const std::size_t terms = std::min(below.eliminated.size(), above.eliminated.size());
  for (std::size_t i = 0; i < terms; ++i) {
    const OwnUnknowns &a = below.eliminated[i], &b = above.eliminated[i];
    for (std::size_t k = 0; k < static_cast<std::size_t>(b.size); ++k) {
      double rate = (b.step[k] - a.step[k]) / (2.0 * kStep);
      for (std::size_t j = 0; j < static_cast<std::size_t>(b.shared_size); ++j) {
        rate -= b.gain(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(j)) *
                shared[b.shared_column[j]];
      }
      by_block[static_cast<std::size_t>(b.own_block[k])][static_cast<std::size_t>(b.own_index[k])] =
          rate;
    }
  }
  return by_block;
}

JointState Moved(const JointState& state, const Values& by_block, double step) {
  JointState moved = state;
  if (by_block.empty()) return moved;
  const std::array<double, 3>& delta = by_block[0];
  moved.rotation *= ExpRotation(step * Eigen::Vector3d(delta[0], delta[1], delta[2]));
  for (std::size_t i = 1; i < by_block.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) moved.values[i][k] += step * by_block[i][k];
  }
  return moved;
}

}  // namespace

RefocusedEvidence::RefocusedEvidence(const JointEvidence& base, double log_focal)
    : evidence_(base) {
  if (log_focal == 0.0) return;
  evidence_.camera = Refocused(base.camera, log_focal);
  is_possible_ =
      std::all_of(evidence_.sets.begin(), evidence_.sets.end(),
                  [&](PointSet& set) { return Refocus(base.camera, evidence_.camera, &set); }) &&
      std::all_of(evidence_.points.begin(), evidence_.points.end(), [&](PointTerm& point) {
        return Refocus(base.camera, evidence_.camera, point.measured.x.x, &point.measured.x);
      });
}

void RefocusedEvidence::KeepInliers(const JointState& state, const JointEvidence& at, double gate) {
  ForEachCurve(at, state,
               [&](const PointSet& set, bool, std::size_t, const std::vector<double>& distances) {
                 std::vector<std::uint8_t> flags;
                 for (const double d : distances)
                   flags.push_back(std::abs(d) <= gate * set.sigma_px ? 1 : 0);
                 const auto index = static_cast<std::size_t>(&set - at.sets.data());
                 KeepFlagged(flags, &evidence_.sets[index].points);
               });
  for (PointSet& set : evidence_.sets) {
    set.loss = LossType::kTrivial;
    set.scatter.reset();
  }
  for (PointTerm& point : evidence_.points) point.measured.loss = LossType::kTrivial;
}

double FocalPriorCost(const JointEvidence& evidence, double log_focal) {
  const double sigma = evidence.options.focal_sigma;
  return sigma > 0.0 ? 0.5 * log_focal * log_focal / (sigma * sigma) : 0.0;
}

// Differences of the inliers' least squares problem: how its reduced gradient moves with the focal
// length is the mixed curvature, how the cost does that its own unknowns leave, the focal length's.
bool ComputeFocalModel(const JointEvidence& base, const JointState& state, double log_focal,
                       double stretch, const Eigen::MatrixXd& shared_covariance,
                       FocalModel* model) {
  const RefocusedEvidence here(base, log_focal);
  const SharedColumns columns(base);
  ReducedModel at[3];
  double cost[3];
  for (int k = 0; k < 3; ++k) {
    const double place = log_focal + (k - 1) * kStep;
    RefocusedEvidence moved = k == 1 ? here : RefocusedEvidence(base, place);
    if (!moved.is_possible()) return false;
    cost[k] = JointCost(moved.evidence(), state, SetWeighing{stretch, false}) +
              FocalPriorCost(base, place);
    moved.KeepInliers(state, here.evidence(), stretch * kInlierSigmas);
    if (!Linearize(moved.evidence(), state, columns, SetWeighing(), &at[k])) return false;
  }
  const auto left = [](const ReducedModel& m) { return m.cost - m.own_gain; };
  model->slope = (cost[2] - cost[0]) / (2.0 * kStep);
  const double curvature = (left(at[0]) - 2.0 * left(at[1]) + left(at[2])) / (kStep * kStep);
  const Eigen::VectorXd mixed = (at[2].gradient - at[0].gradient) / (2.0 * kStep);
  model->by_focal = -shared_covariance * mixed;
  model->information = std::max(0.0, curvature + mixed.dot(model->by_focal));
  model->by_block = Follow(base, columns, model->by_focal, at[0], at[2]);
  return std::isfinite(model->information) && std::isfinite(model->slope);
}

Status MinimizeWithFocal(const JointEvidence& base, double tolerance, JointState* state,
                         double* log_focal) {
  constexpr int kMaxSteps = 30;
  constexpr double kSmallStep = 0.01;  // Standard deviations.
  constexpr double kFarthest = 4.0;    // Standard deviations of the prior.
  constexpr double kShrink = 0.5;      // Of the stretch, and of a step that leads uphill.
  const double sigma = base.options.focal_sigma;
  double stretch = NeededStretch(RefocusedEvidence(base, *log_focal).evidence(), *state);
  double cost = 0.0, trial = *log_focal, spread = 0.0;
  bool is_first = true;  // With this stretch: at the same focal length, for costs to compare with.
  FocalModel model;
  for (int i = 0; i < kMaxSteps; ++i) {
    const RefocusedEvidence at(base, trial);
    JointState moved = Moved(*state, model.by_block, trial - *log_focal);
    double moved_cost = std::numeric_limits<double>::infinity();
    if (at.is_possible()) {
      const Status status =
          Minimize(at.evidence(), stretch, base.options.max_iterations, tolerance, &moved);
      if (!status.ok()) return status;
      moved_cost = JointCost(at.evidence(), moved, SetWeighing{stretch, false}) +
                   FocalPriorCost(base, trial);
    }
    const double step = trial - *log_focal;
    bool is_done = !is_first && std::abs(step) < kSmallStep * spread;
    if (is_first || moved_cost <= cost + tolerance) {
      *state = moved;
      *log_focal = trial;
      cost = moved_cost;
    } else if (!is_done) {  // Uphill.
      trial = *log_focal + kShrink * step;
      continue;
    }
    if (!is_done) {
      SharedCovariance shared;
      // Else some feature has no inliers here, or lies at the lens' rim: nothing to steer by.
      is_done = !ComputeCovariance(at.evidence(), *state, &shared, stretch) ||
                !ComputeFocalModel(base, *state, *log_focal, stretch, shared.covariance, &model);
    }
    if (!is_done) {
      const double variance = 1.0 / (model.information + 1.0 / (sigma * sigma));
      spread = std::sqrt(variance);
      trial =
          std::clamp(*log_focal - variance * model.slope, -kFarthest * sigma, kFarthest * sigma);
    }
    if (is_done && stretch <= 1.0) break;
    const bool narrows = stretch > 1.0 && (is_done || !is_first);
    is_first = narrows;
    if (!narrows) continue;
    trial = *log_focal;
    const RefocusedEvidence here(base, trial);
    stretch = std::max(1.0, std::min(kShrink * stretch, NeededStretch(here.evidence(), *state)));
  }
  return Status::Ok();
}

}  // namespace circline
