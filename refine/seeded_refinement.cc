#include "circline/refine/seeded_refinement.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "circline/estimators/circle_pose.h"
#include "circline/estimators/closed_form_solvers.h"
#include "circline/refine/crowds.h"
#include "circline/refine/joint_problem.h"

namespace circline {
namespace {

// Seeds closer than this are one; far inside the basin of convergence of each other.
constexpr double kSameSeed = 0.02;  // Radians.
// Seeds that arrive this close to each other in a few iterations go to one minimum.
constexpr double kSameApproach = 1e-3;  // Radians.
// Refined poses closer than this are one.
constexpr double kSamePose = 1e-4;  // Radians; far below any standard deviation.
constexpr std::size_t kMaxSeeds = 8;
constexpr std::size_t kMaxCircleSeeds = 6;  // Circles that propose both their planes.
// Where nothing is redundant, so that nothing can be measured.
constexpr double kDefaultConicSigmaPx = 0.3;
constexpr double kDefaultLineSigmaPx = 0.4;

// 1.4826 x the median of |values|: the standard deviation of a Gaussian, whatever the outliers.
double MadSigma(std::vector<double> values) {
  if (values.empty()) return 0.0;
  for (double& v : values) v = std::abs(v);
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return 1.4826 * *middle;
}

// Scatter of the points about their own fits, the degrees of freedom of each fit counted in.
double ConicScale(const Observations& observations) {
  std::vector<double> residuals;
  std::vector<CalibratedPoint> points;
  for (const CircleObservation& circle : observations.circles) {
    if (!circle.fit || circle.sigma_px > 0.0) continue;
    CalibrateInliers(observations.camera, circle.points, circle.inliers, &points);
    if (points.size() <= 5) continue;
    const double n = static_cast<double>(points.size());
    const double gain = std::sqrt(n / (n - 5.0));
    for (const CalibratedPoint& p : points)
      residuals.push_back(gain * ConicDistancePx(p, circle.fit->conic));
  }
  return MadSigma(std::move(residuals));
}

// The same for lines of more than two points; segments known by their ends alone are judged by how
// far they miss their pencil's vanishing point, in standard deviations if the ends' were 1 px.
double LineScale(const Observations& observations) {
  std::vector<double> along, across;
  std::vector<CalibratedPoint> points;
  for (const PencilObservation& pencil : observations.pencils) {
    const double lines = static_cast<double>(pencil.lines.size());
    for (const LineObservation& line : pencil.lines) {
      if (!line.fit || LineSigma(pencil, line) > 0.0) continue;
      CalibrateInliers(observations.camera, line.points, line.inliers, &points);
      const double n = static_cast<double>(points.size());
      if (n > 2.0) {
        const double gain = std::sqrt(n / (n - 2.0));
        for (const CalibratedPoint& p : points)
          along.push_back(gain * LineDistancePx(p, line.fit->line));
      } else if (pencil.fit && lines > 2.0) {
        LineFit unit;
        if (!FitLine(points, 1.0, &unit).ok()) continue;
        across.push_back(std::sqrt(lines / (lines - 2.0)) *
                         VanishingPointResidual(unit, pencil.fit->direction));
      }
    }
  }
  constexpr std::size_t kEnough = 8;
  if (along.size() >= kEnough) return MadSigma(std::move(along));
  return across.size() >= kEnough ? MadSigma(std::move(across)) : 0.0;
}

// "auto": measured, where anything is redundant; else 0.
NoiseScales MeasureScales(const Observations& observations) {
  return {ConicScale(observations), LineScale(observations)};
}

NoiseScales OrDefault(const NoiseScales& scales) {
  return {scales.conic_px > 0.0 ? scales.conic_px : kDefaultConicSigmaPx,
          scales.line_px > 0.0 ? scales.line_px : kDefaultLineSigmaPx};
}

// For the closed forms: gives every feature that states no sigma_px the one that options or
// measurement say, its shared error included (EstimationOptions::contour_bias_px).
Observations ApplyScales(const Observations& observations, const EstimationOptions& options,
                         const NoiseScales& scales) {
  Observations out = observations;
  const auto effective = [](const LossOptions& loss, double sigma, double bias, std::size_t n) {
    if (loss.scale_px > 0.0) return loss.scale_px;
    return std::sqrt(sigma * sigma + static_cast<double>(n) * bias * bias);
  };
  for (CircleObservation& circle : out.circles) {
    if (circle.sigma_px > 0.0) continue;
    circle.sigma_px = effective(options.conic_loss, scales.conic_px, options.contour_bias_px,
                                circle.points.size());
  }
  for (PencilObservation& pencil : out.pencils) {
    if (pencil.sigma_px > 0.0) continue;
    std::size_t longest = 2;
    for (const LineObservation& line : pencil.lines)
      longest = std::max(longest, line.points.size());
    pencil.sigma_px = effective(options.line_loss, scales.line_px, options.line_bias_px, longest);
  }
  return out;
}

struct Seed {
  CameraPose pose;
  double cost;
  int source;  // The two poses of one circle, however close, are two seeds.
};

void AddSeed(const JointProblem& problem, const CameraPose& pose, int source,
             std::vector<Seed>* seeds) {
  const auto same = std::find_if(seeds->begin(), seeds->end(), [&](const Seed& seed) {
    return seed.source != source && RotationAngle(seed.pose.rotation, pose.rotation) <= kSameSeed;
  });
  // The better of the two matters only where outliers make the way to the minimum hard.
  if (same != seeds->end() && !problem.is_contaminated()) return;
  const double cost = problem.SeedCost(pose);
  if (!std::isfinite(cost)) return;
  if (same != seeds->end()) {
    if (cost < same->cost) *same = {pose, cost, source};
    return;
  }
  seeds->push_back({pose, cost, source});
}

// The rotations about the plane's normal under which one line or another of a pencil along an axis
// has its direction: some of these lines may be wrong. The senses of the axes are those of
// `rotation`.
void AddSpinSeeds(const Observations& observations, const JointProblem& problem,
                  const CameraPose& pose, int source, std::vector<Seed>* seeds) {
  constexpr int kMaxLines = 8;
  int lines = 0;
  const Eigen::Vector3d n = pose.rotation.col(2);
  for (const PencilObservation& pencil : observations.pencils) {
    if (pencil.direction != PencilDirection::kX && pencil.direction != PencilDirection::kY)
      continue;
    const Eigen::Vector3d axis = pose.rotation.col(static_cast<int>(pencil.direction));
    for (const LineObservation& line : pencil.lines) {
      if (!line.fit || ++lines > kMaxLines) continue;
      Eigen::Vector3d direction = n.cross(line.fit->line);
      if (direction.dot(axis) < 0.0) direction = -direction;
      const double angle = std::atan2(axis.cross(direction).dot(n), axis.dot(direction));
      AddSeed(problem, {ExpRotation(angle * n) * pose.rotation, pose.translation}, source, seeds);
    }
  }
}

// Both planes of the largest circles of the world plane, turned in the plane as the other evidence
// says.
void AddCircleSeeds(const Observations& observations, const JointProblem& problem,
                    std::vector<Seed>* seeds) {
  std::vector<const CircleObservation*> circles;
  for (const CircleObservation& circle : observations.circles) {
    if (circle.fit && circle.plane == observations.frame.plane) circles.push_back(&circle);
  }
  std::stable_sort(circles.begin(), circles.end(),
                   [](const CircleObservation* a, const CircleObservation* b) {
                     return a->fit->Covariance().trace() < b->fit->Covariance().trace();
                   });
  circles.resize(std::min(circles.size(), kMaxCircleSeeds));
  int source = 0;
  for (const CircleObservation* circle : circles) {
    --source;  // Closed forms count upwards.
    std::array<CirclePose, 2> poses;
    const int count = CirclePoses(circle->fit->conic, &poses);
    for (int i = 0; i < count; ++i) {
      const CirclePose& p = poses[static_cast<std::size_t>(i)];
      CameraPose pose;
      if (!WorldRotation(observations, p.normal, p.center, kDefaultLineSigmaPx, &pose.rotation))
        continue;
      pose.translation = p.center;
      AddSeed(problem, pose, source, seeds);
      if (problem.is_contaminated()) AddSpinSeeds(observations, problem, pose, source, seeds);
    }
  }
}

// Poses that the closed forms propose for the same world plane, and those of its circles. `reason`
// receives why the last of the closed forms refused.
std::vector<CameraPose> CollectSeeds(const Observations& observations,
                                     const std::vector<std::shared_ptr<const Solver>>& seeders,
                                     const EstimationOptions& options, const JointProblem& problem,
                                     std::vector<std::string>* reasons) {
  std::vector<Seed> seeds;
  int source = 0;
  for (const std::shared_ptr<const Solver>& seeder : seeders) {
    const PoseEstimate estimate = seeder->Seeds(observations);
    if (!estimate.status.ok()) {
      reasons->push_back(seeder->name() + ": " + estimate.status.message);
      continue;
    }
    ++source;
    for (const PoseHypothesis& h : estimate.hypotheses) {
      CameraPose pose = h.cam_from_world;
      // A solver that leaves the spin about the normal open has chosen it by convention; the other
      // evidence knows better.
      if (h.RotationIsFree() && !WorldRotation(observations, pose.rotation.col(2), pose.translation,
                                               kDefaultLineSigmaPx, &pose.rotation)) {
        continue;
      }
      AddSeed(problem, pose, source, &seeds);
    }
  }
  AddCircleSeeds(observations, problem, &seeds);
  std::stable_sort(seeds.begin(), seeds.end(),
                   [](const Seed& a, const Seed& b) { return a.cost < b.cost; });
  seeds.resize(std::min(seeds.size(), kMaxSeeds));
  // A closed form lies so near its minimum that one that costs far more leads to none that counts.
  constexpr double kMargin = 4.0;
  std::vector<CameraPose> poses;
  for (const Seed& seed : seeds) {
    if (seed.cost <= kMargin * (seeds.front().cost + options.max_cost_gap))
      poses.push_back(seed.pose);
  }
  return poses;
}

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

// Features that fit well one by one may fit badly together (a plane not quite flat): then the
// scatter about the common pose is the noise that counts. True if that raised an automatic scale.
bool RaiseScales(const NoiseScales& measured, NoiseScales* scales) {
  constexpr double kTolerated = 1.3;
  const bool conic = measured.conic_px > kTolerated * scales->conic_px;
  const bool line = measured.line_px > kTolerated * scales->line_px;
  if (conic) scales->conic_px = measured.conic_px;
  if (line) scales->line_px = measured.line_px;
  return conic || line;
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
  NoiseScales scales = MeasureScales(fitted);
  const Observations scaled = ApplyScales(fitted, options, OrDefault(scales));
  JointProblem problem(fitted, options, OrDefault(scales));
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
