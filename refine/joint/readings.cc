#include "circline/refine/joint/readings.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <optional>
#include <utility>

#include "circline/estimators/closed_form_solvers.h"
#include "circline/estimators/focal_starts.h"
#include "circline/estimators/point_noise.h"
#include "circline/refine/joint/joint_problem.h"
#include "circline/refine/joint/joint_result.h"

namespace circline {
namespace {

// What tells the best hypothesis from the next, in words.
std::string DecidedBy(const std::vector<PoseHypothesis>& hypotheses) {
  if (hypotheses.size() < 2) return "only one pose fits the evidence";
  const double gap = hypotheses[1].cost - hypotheses[0].cost;
  // Below 0.5, negative included, the determinants decide, not the residuals.
  if (gap < 0.5) return "nothing decides: both poses explain the evidence equally well";
  char text[120];
  std::snprintf(text, sizeof(text),
                "residuals: chi-square lower by %.3g than that of the second pose", 2.0 * gap);
  return text;
}

std::string Join(const std::vector<std::string>& parts) {
  std::string out;
  for (const std::string& part : parts) out += (out.empty() ? "" : "; ") + part;
  return out;
}

template <typename Feature>
std::ptrdiff_t CountFits(const std::vector<Feature>& features) {
  return std::count_if(features.begin(), features.end(),
                       [](const Feature& f) { return f.fit.has_value(); });
}

// What is missing for a pose; where that is no circle or pencil, what the closed forms say.
Status NoSeed(const Observations& fitted, const std::vector<std::string>& reasons) {
  const std::ptrdiff_t pencils = CountFits(fitted.pencils);
  if (CountFits(fitted.circles) > 0 || pencils > 1) return Status::Refused(Join(reasons));
  if (pencils == 0) {
    std::string message = "a pose takes a circle or two pencils of parallel lines; ";
    const bool is_given = !fitted.circles.empty() || !fitted.pencils.empty();
    message += is_given ? "none that is given could be fitted" : "there is neither";
    if (fitted.num_dropped_points > 0) {
      message +=
          ": the camera cannot have seen some of the points, as its focal length or its lens is "
          "wrong";
    }
    return Status::Refused(message);
  }
  const auto only = std::find_if(fitted.pencils.begin(), fitted.pencils.end(),
                                 [](const PencilObservation& p) { return p.fit.has_value(); });
  return Status::Refused("there is only one pencil of parallel lines ('" + only->id +
                         "'); a pose takes another one, a circle, or a prior: a pose, or gravity "
                         "that does not run along it");
}

// The prior pose and the circles' planes, where the prior leads to a pose that explains the points.
std::vector<Seed> SeedsFromPrior(const JointProblem& problem, const Observations& resolved) {
  constexpr double kExplained = 0.8;
  constexpr int kIterations = 6;
  if (!problem.options().prior) return {};
  std::vector<Seed> seeds = {{*problem.options().prior, 0.0, 0}};
  State state;
  if (!problem.Start(seeds[0].pose, 0.0, problem.FirstReading(), &state).ok() ||
      !problem.Solve(kIterations, &state).ok())
    return {};
  PoseHypothesis reached;
  CountInliers(problem, state, &reached);
  if (reached.num_inliers == 0 || reached.num_inliers < kExplained * reached.num_observations)
    return {};
  seeds[0].pose = problem.PoseAt(state);
  seeds[0].log_focal = problem.LogFocalAt(state);
  AddCircleSeeds(resolved, 0.0, &seeds);
  return seeds;
}

// Logarithms of the focal lengths from which it is searched, against the one given: over the prior,
// and what closed forms say.
std::vector<double> FocalStarts(const JointProblem& problem, const Observations& resolved) {
  constexpr std::size_t kMostClosedForms = 3;
  constexpr double kReach = 3.0;  // Standard deviations of the prior.
  const double sigma = problem.camera_sigma().LargestLogFocal();
  const double mean = StatedLogFocal(resolved);
  constexpr double kSameStart = 0.02;  // Near the camera's own, which is one in any case.
  std::size_t num_closed_forms = 0;
  std::vector<double> starts;
  if (resolved.stated_focal_px > 0.0) {  // The structure has been compared over the prior.
    if (std::abs(mean) > kSameStart) starts.push_back(mean);
  } else {
    for (const double start : {-1.6, -0.8, 0.8, 1.6}) starts.push_back(start * sigma);
  }
  NoiseModel noise = problem.options().noise_model;
  noise.camera = problem.camera_sigma();
  for (const FocalStart& start : FocalLengthStarts(resolved, kAnySigmaPx, noise)) {
    const double log_focal = std::log(start.focal_px / resolved.camera.fx);
    if (num_closed_forms == kMostClosedForms) break;
    if (std::abs(log_focal - mean) > kReach * sigma || std::abs(log_focal) <= kSameStart) continue;
    starts.push_back(log_focal);
    ++num_closed_forms;
  }
  return starts;
}

// A direction for a pencil that its lines leave open between two.
std::optional<VanishingPointFit> SecondDirection(const PencilObservation& pencil) {
  constexpr double kKnown = 0.01;  // Radians: not open.
  if (!pencil.fit || pencil.fit->covariance.trace() < kKnown * kKnown) return {};
  std::vector<LineFit> lines;
  for (const LineObservation& line : pencil.lines) {
    if (line.fit) lines.push_back(*line.fit);
  }
  VanishingPointFit best, second;
  if (!FitVanishingPoint(lines, &best, nullptr, &second).ok() || second.direction.isZero())
    return {};
  return second;
}

// What the closed forms say with a pencil's second direction: the other evidence tells which. Of
// many pencils one does not matter. It is what corridors of few lines need: without it 22 of 40 000
// fit worse than the truth (PencilsTest).
void AddSecondDirections(const Observations& resolved,
                         const std::vector<std::shared_ptr<const Solver>>& seeders,
                         std::vector<Seed>* seeds) {
  constexpr std::size_t kManyPencils = 6;  // For time; not chosen on photos.
  if (resolved.pencils.size() > kManyPencils) return;
  for (std::size_t i = 0; i < resolved.pencils.size(); ++i) {
    const std::optional<VanishingPointFit> second = SecondDirection(resolved.pencils[i]);
    if (!second) continue;
    Observations other = resolved;
    other.pencils[i].fit = second;
    const std::vector<Seed> more = CollectSeeds(other, seeders, 0.0);
    seeds->insert(seeds->end(), more.begin(), more.end());
  }
}

std::vector<Seed> AllSeeds(const JointProblem& problem, const Observations& resolved,
                           const std::vector<std::shared_ptr<const Solver>>& seeders,
                           std::vector<std::string>* reasons) {
  std::vector<Seed> seeds = CollectSeeds(resolved, seeders, 0.0, reasons);
  AddSecondDirections(resolved, seeders, &seeds);
  const bool takes_priors = seeds.empty() && !problem.lines().empty();
  if (takes_priors) AddPriorSeeds(problem.options(), resolved, 0.0, &seeds);
  if (!problem.camera_is_estimated() || !problem.camera_sigma().IsWide()) return seeds;
  // What can be seen through another focal length alone takes no part in the problem.
  const bool is_seen =
      CountFits(resolved.circles) > 0 || CountFits(resolved.pencils) > (takes_priors ? 0 : 1);
  if (!is_seen) return seeds;
  for (const double start : FocalStarts(problem, resolved)) {
    const Observations refocused = Refocused(problem, start);
    std::vector<Seed> more = CollectSeeds(refocused, seeders, start);
    if (takes_priors) AddPriorSeeds(problem.options(), refocused, start, &more);
    seeds.insert(seeds.end(), more.begin(), more.end());
  }
  return seeds;
}

// The noise model as the photo's own features have it, at the minimum that the best seed leads to;
// the seed then starts there.
NoiseModel ScaledToFirstMinimum(const JointProblem& problem, std::vector<Seed>* seeds) {
  Status unused;
  // What is told of angles is no feature's error, and where it is wrong all would seem to have
  // some.
  Reading reading = problem.FirstReading();
  for (std::size_t i = 0; i < reading.size(); ++i) {
    if (problem.features()[i].kind == Feature::Kind::kAngle) reading[i] = 0;
  }
  std::vector<SeedStart> starts = StartsOf(problem, *seeds, reading, &unused);
  if (starts.empty() ||
      !problem.SolveGraduated(problem.options().max_iterations, &starts.front().state).ok())
    return problem.options().noise_model;
  const State& best = starts.front().state;
  Seed* best_seed = &(*seeds)[starts.front().seed];
  best_seed->pose = problem.PoseAt(best);
  best_seed->log_focal = problem.LogFocalAt(best);
  return ScaledNoiseModel(problem, best);
}

Status RefineAsRead(const Observations& resolved,
                    const std::vector<std::shared_ptr<const Solver>>& seeders,
                    const EstimationOptions& options, PoseEstimate* estimate) {
  const JointProblem as_stated(resolved, options);
  estimate->notes.insert(estimate->notes.end(), as_stated.unused().begin(),
                         as_stated.unused().end());
  std::vector<std::string> reasons;
  std::vector<Seed> seeds = SeedsFromPrior(as_stated, resolved);
  if (seeds.empty()) seeds = AllSeeds(as_stated, resolved, seeders, &reasons);
  if (seeds.empty()) return NoSeed(resolved, reasons);
  EstimationOptions scaled_options = options;
  std::optional<JointProblem> scaled;
  if (HasManyFeatures(as_stated)) {
    scaled_options.noise_model = ScaledToFirstMinimum(as_stated, &seeds);
    scaled.emplace(resolved, scaled_options);
  }
  const JointProblem& problem = scaled ? *scaled : as_stated;
  std::vector<State> minima;
  const Status status = FindMinima(problem, seeds, &minima);
  if (!status.ok()) {
    reasons.insert(reasons.begin(), "no pose agrees with all evidence: " + status.message);
    return Status::Refused(Join(reasons));
  }
  return RankReadings(problem, minima, estimate);
}

// Through a camera that is a guess, with the axes and, where these are doubted, without. Any closed
// form may start the latter: those that take two axes have none left.
void RefineResolved(const Observations& resolved,
                    const std::vector<std::shared_ptr<const Solver>>& seeders,
                    const EstimationOptions& options, PoseEstimate* estimate) {
  const PoseEstimate before = *estimate;
  estimate->status = RefineAsRead(resolved, seeders, options, estimate);
  const CameraSigma sigma =
      options.camera_sigma.value_or(options.noise_model.SigmaOf(resolved.camera));
  if (!estimate->status.ok() || !sigma.IsWide()) return;
  const std::vector<AxesReading> readings = ReadingsOfAxes(resolved);
  if (readings.size() == 1) return;
  SolverRegistry built_in;
  AddClosedFormSolvers(&built_in);
  std::vector<PoseEstimate> estimates = {*estimate};
  for (std::size_t k = 1; k < readings.size(); ++k) {
    PoseEstimate without = before;
    without.status = RefineAsRead(readings[k].observations, built_in.solvers(), options, &without);
    estimates.push_back(std::move(without));
  }
  *estimate = UnitedReadings(readings, std::move(estimates));
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

  Observations resolved = ResolveWorld(observations);
  FitDirect(FitSigmaPx(options), &resolved, &estimate.notes, options.noise_model);
  resolved = ResolveWorld(resolved);
  StateNoise(MeasurePointNoise(resolved, options.noise_model), options.conic_loss.scale_px,
             options.line_loss.scale_px, &resolved);
  RefineResolved(resolved, seeders, options, &estimate);
  if (estimate.status.ok() && estimate.decided_by.empty())
    estimate.decided_by = DecidedBy(estimate.hypotheses);
  return estimate;
}

}  // namespace circline
