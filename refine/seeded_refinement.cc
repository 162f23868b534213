#include "circline/refine/seeded_refinement.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <utility>

#include "circline/estimators/closed_form_solvers.h"
#include "circline/refine/crowds.h"
#include "circline/refine/joint_problem.h"
#include "circline/refine/noise_scales.h"
#include "circline/refine/pose_seeds.h"

namespace circline {
namespace {

// Seeds that arrive this close to each other in a few iterations go to one minimum.
constexpr double kSameApproach = 1e-3;  // Radians.
// Refined poses closer than this are one.
constexpr double kSamePose = 1e-4;  // Radians; far below any standard deviation.

// What tells the best hypothesis from the next, in words.
std::string DecidedBy(const std::vector<PoseHypothesis>& hypotheses) {
  if (hypotheses.size() < 2) return "only one pose fits the evidence";
  const double gap = hypotheses[1].cost - hypotheses[0].cost;
  char text[120];
  // Below nought the widths of the minima have tipped the scales, as far as they ever do.
  if (gap < 0.5) return "nothing decides: both poses explain the evidence equally well";
  std::snprintf(text, sizeof(text),
                "residuals: chi-square lower by %.3g than that of the second pose", 2.0 * gap);
  return text;
}

std::string Join(const std::vector<std::string>& parts) {
  std::string out;
  for (const std::string& part : parts) out += (out.empty() ? "" : "; ") + part;
  return out;
}

// A few iterations from every pose, the lowest cost first, those that arrive at one place counted
// once. `last` receives why the last one that failed did.
std::vector<Approach> ApproachAll(const JointProblem& problem, const std::vector<CameraPose>& poses,
                                  Status* last) {
  std::vector<Approach> approaches;
  for (const CameraPose& pose : poses) {
    Approach approach;
    const Status status = problem.ApproachFrom(pose, &approach);
    if (status.ok()) {
      approaches.push_back(approach);
    } else {
      *last = status;
    }
  }
  std::stable_sort(approaches.begin(), approaches.end(),
                   [](const Approach& a, const Approach& b) { return a.cost < b.cost; });
  std::vector<Approach> distinct;
  for (const Approach& a : approaches) {
    const bool known = std::any_of(distinct.begin(), distinct.end(), [&](const Approach& b) {
      return RotationAngle(a.pose.rotation, b.pose.rotation) < kSameApproach;
    });
    if (!known) distinct.push_back(a);
  }
  return distinct;
}

// Hypotheses that explain different features compare on those that all of them do.
void CompareOnCommonEvidence(std::vector<Refined>* refined) {
  std::vector<std::uint8_t> left_out = refined->front().left_out;
  for (const Refined& r : *refined) {
    for (std::size_t i = 0; i < left_out.size(); ++i) left_out[i] |= r.left_out[i];
  }
  for (Refined& r : *refined) r.hypothesis.log_det = LogDet(r, left_out);
}

// One pose, up to what the evidence cannot tell: the spin about the normal where that is free, and
// the senses of the axes, which are settled by convention and may tip over.
bool IsSamePose(const PoseHypothesis& a, const PoseHypothesis& b, bool spin_is_free) {
  const Eigen::Matrix3d &A = a.cam_from_world.rotation, &B = b.cam_from_world.rotation;
  const Eigen::Vector3d &s = a.cam_from_world.translation, &t = b.cam_from_world.translation;
  if (s.cross(t).norm() > kSamePose * s.norm() * t.norm()) return false;
  if (A.col(2).cross(B.col(2)).norm() > kSamePose) return false;
  return spin_is_free || A.col(0).cross(B.col(0)).norm() < kSamePose;
}

// Runs the approaches to their end; ranked, without duplicates and without those that cannot
// compete.
Status RefineApproaches(const JointProblem& problem, const Observations& scaled,
                        const EstimationOptions& options, const std::vector<Approach>& approaches,
                        PoseEstimate* estimate) {
  // An approach has not converged, so that its cost still falls.
  constexpr double kMargin = 3.0;
  Status last = Status::Failed("no seed pose could be refined");
  std::vector<Refined> all;
  for (const Approach& approach : approaches) {
    if (approach.cost > approaches.front().cost * kMargin + kMargin * options.max_cost_gap)
      continue;
    Refined refined;
    const Status status = problem.Refine(approach, &refined);
    if (!status.ok()) {
      last = status;
      continue;
    }
    const bool known = std::any_of(all.begin(), all.end(), [&](const Refined& r) {
      return IsSamePose(r.hypothesis, refined.hypothesis, problem.spin_is_free());
    });
    if (!known) all.push_back(std::move(refined));
  }
  if (all.empty()) return last;
  const auto cheapest = std::min_element(all.begin(), all.end(), [](const auto& a, const auto& b) {
    return a.hypothesis.cost < b.hypothesis.cost;
  });
  const double most = cheapest->hypothesis.cost + options.max_cost_gap;
  estimate->notes.insert(estimate->notes.end(), cheapest->notes.begin(), cheapest->notes.end());
  all.erase(std::remove_if(all.begin(), all.end(),
                           [most](const Refined& r) { return r.hypothesis.cost > most; }),
            all.end());
  CompareOnCommonEvidence(&all);
  for (Refined& refined : all) {
    CameraPose& pose = refined.hypothesis.cam_from_world;
    // A spin that nothing fixes is settled by convention, whatever the seed's was.
    if (problem.spin_is_free()) {
      WorldRotation(scaled, pose.rotation.col(2), pose.translation, kDefaultLineSigmaPx,
                    &pose.rotation);
    }
    estimate->hypotheses.push_back(std::move(refined.hypothesis));
  }
  RankHypotheses(&estimate->hypotheses);
  return Status::Ok();
}

// True if the prior pose (if any) leads to one that explains the points.
bool ApproachFromPrior(const JointProblem& problem, const EstimationOptions& options,
                       std::vector<Approach>* approaches) {
  constexpr double kExplained = 0.8;
  Approach approach;
  if (!options.prior || !problem.ApproachFrom(*options.prior, &approach).ok() ||
      !(problem.InlierShare(approach) >= kExplained)) {
    return false;
  }
  approaches->push_back(std::move(approach));
  return true;
}

// What the closed forms missed, led by the one thing where all of them miss it.
Status NoSeed(const Observations& fitted, const std::vector<std::string>& reasons) {
  const auto has_fit = [](const auto& feature) { return feature.fit.has_value(); };
  const auto circles = std::count_if(fitted.circles.begin(), fitted.circles.end(), has_fit);
  const auto pencils = std::count_if(fitted.pencils.begin(), fitted.pencils.end(), has_fit);
  if (circles > 0 || pencils > 1) return Status::Refused(Join(reasons));
  const std::string lead = "a pose takes a circle or two pencils of parallel lines; there is " +
                           std::string(pencils == 0 ? "neither" : "one pencil only");
  return Status::Refused(reasons.empty() ? lead : lead + " (" + Join(reasons) + ")");
}

Status RefineFitted(const Observations& fitted,
                    const std::vector<std::shared_ptr<const Solver>>& seeders,
                    const EstimationOptions& options, PoseEstimate* estimate) {
  NoiseScales scales = ScatterAboutFits(fitted);
  const Observations scaled = ApplyScales(fitted, options, OrDefault(scales));
  JointProblem problem(fitted, options, OrDefault(scales));
  estimate->notes.insert(estimate->notes.end(), problem.unused().begin(), problem.unused().end());
  std::vector<Approach> approaches;
  if (ApproachFromPrior(problem, options, &approaches)) {
    const Status status = RefineApproaches(problem, scaled, options, approaches, estimate);
    if (status.ok()) {
      estimate->decided_by = "the prior pose";
      return status;
    }
  }
  std::vector<std::string> reasons;
  const std::vector<CameraPose> seeds = CollectSeeds(scaled, seeders, options, problem, &reasons);
  Status last = NoSeed(fitted, reasons);
  approaches = ApproachAll(problem, seeds, &last);
  if (approaches.empty()) return last;
  if (RaiseScales(approaches.front().scales, &scales)) {
    problem.SetScales(OrDefault(scales));
    for (Approach& approach : approaches) problem.Continue(&approach);
  }
  return RefineApproaches(problem, scaled, options, approaches, estimate);
}

}  // namespace

PoseEstimate RefineSeeds(const std::string& name,
                         const std::vector<std::shared_ptr<const Solver>>& seeders,
                         const Observations& observations, const EstimationOptions& options) {
  PoseEstimate estimate;
  estimate.solver = name;
  estimate.status = options.Validate();
  if (estimate.status.ok()) estimate.status = observations.Validate();
  if (!estimate.status.ok()) return estimate;

  Observations fitted = observations;
  FitDirect(options.line_loss.scale_px > 0.0 ? options.line_loss.scale_px : kDefaultLineSigmaPx,
            &fitted, &estimate.notes);
  RefitWithoutCrowds(options, &fitted);
  fitted = ResolveWorld(fitted);
  estimate.status = RefineFitted(fitted, seeders, options, &estimate);
  if (estimate.status.ok() && estimate.decided_by.empty())
    estimate.decided_by = DecidedBy(estimate.hypotheses);
  return estimate;
}

}  // namespace circline
