#include "circline/refine/readings.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <iterator>
#include <limits>
#include <optional>
#include <utility>

#include "circline/estimators/closed_form_solvers.h"
#include "circline/estimators/focal_starts.h"
#include "circline/estimators/point_noise.h"
#include "circline/refine/imperfection_scales.h"
#include "circline/refine/joint_problem.h"
#include "circline/refine/joint_result.h"
#include "circline/refine/pose_seeds.h"
#include "circline/refine/reading_search.h"

namespace circline {
namespace {

// Wide priors of the focal length are searched at these, in standard deviations.
constexpr double kFocalStarts[] = {-1.6, -0.8, 0.8, 1.6};
constexpr int kForScales = 2;  // Iterations: near enough to see how far features miss each other.

// What tells the best hypothesis from the next, in words.
std::string DecidedBy(const std::vector<PoseHypothesis>& hypotheses) {
  if (hypotheses.size() < 2) return "only one pose fits the evidence";
  const double gap = hypotheses[1].cost - hypotheses[0].cost;
  char text[120];
  // Below 0.5, negative included, the determinants decide, not the residuals.
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

// The prior pose and the circles' planes, where the prior leads to a pose that explains the points.
std::vector<Seed> SeedsFromPrior(const JointProblem& problem, const Observations& resolved) {
  constexpr double kExplained = 0.8;
  constexpr int kIterations = 6;
  if (!problem.options().prior) return {};
  std::vector<Seed> seeds = {{*problem.options().prior, 0.0, 0}};
  State state;
  if (!problem.Start(seeds[0].pose, 0.0, problem.FirstReading(), &state).ok() ||
      !problem.Solve(kIterations, &state).ok() || !(problem.InlierShare(state) >= kExplained)) {
    return {};
  }
  seeds[0].pose = problem.PoseAt(state);
  seeds[0].log_focal = problem.LogFocalAt(state);
  AddCircleSeeds(resolved, 0.0, &seeds);
  return seeds;
}

// Logarithms of the focal lengths from which it is searched, against the one given: over the prior,
// and what closed forms say.
std::vector<double> FocalStarts(const JointProblem& problem, const Observations& resolved) {
  constexpr std::size_t kMostClosedForms = 3;
  constexpr double kReach = 3.0;       // Standard deviations of the prior.
  constexpr double kAnySigmaPx = 0.5;  // Every feature has its own.
  const double sigma = problem.camera_sigma().LargestLogFocal();
  const double mean = StatedLogFocal(resolved);
  constexpr double kSameStart = 0.02;  // Near the camera's own, which is one in any case.
  std::size_t num_closed_forms = 0;
  std::vector<double> starts;
  if (resolved.stated_focal_px > 0.0) {  // The structure has been compared over the prior.
    if (std::abs(mean) > kSameStart) starts.push_back(mean);
  } else {
    for (const double start : kFocalStarts) starts.push_back(start * sigma);
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

// What the closed forms say with a pencil's second direction: the other evidence tells which.
void AddSecondDirections(const Observations& resolved,
                         const std::vector<std::shared_ptr<const Solver>>& seeders,
                         std::vector<Seed>* seeds) {
  for (std::size_t i = 0; i < resolved.pencils.size(); ++i) {
    const std::optional<VanishingPointFit> second = SecondDirection(resolved.pencils[i]);
    if (!second) continue;
    Observations other = resolved;
    other.pencils[i].fit = second;
    std::vector<std::string> unused;
    const std::vector<Seed> more = CollectSeeds(other, seeders, 0.0, &unused);
    seeds->insert(seeds->end(), more.begin(), more.end());
  }
}

std::vector<Seed> AllSeeds(const JointProblem& problem, const Observations& resolved,
                           const std::vector<std::shared_ptr<const Solver>>& seeders,
                           std::vector<std::string>* reasons) {
  std::vector<Seed> seeds = CollectSeeds(resolved, seeders, 0.0, reasons);
  AddSecondDirections(resolved, seeders, &seeds);
  if (!problem.camera_is_estimated() || !problem.camera_sigma().IsWide()) return seeds;
  for (const double start : FocalStarts(problem, resolved)) {
    std::vector<std::string> unused;
    const std::vector<Seed> more =
        CollectSeeds(Refocused(resolved, start), seeders, start, &unused);
    seeds.insert(seeds.end(), more.begin(), more.end());
  }
  return seeds;
}

// The noise model as the photo's own features have it, at the minimum that the best seed leads to;
// the seed then starts there.
NoiseModel ScaledToFirstMinimum(const JointProblem& problem, std::vector<Seed>* seeds) {
  const std::vector<std::uint8_t> reading = problem.FirstReading();
  State state, best;
  Seed* best_seed = nullptr;
  double least = std::numeric_limits<double>::infinity();
  for (Seed& seed : *seeds) {
    if (!problem.Start(seed.pose, seed.log_focal, reading, &state).ok()) continue;
    const double cost = state.cost + LeftOutCost(problem, state);
    if (!(cost < least)) continue;
    least = cost;
    best = state;
    best_seed = &seed;
  }
  const int max_iterations = std::min(kForScales, problem.options().max_iterations);
  if (best_seed == nullptr || !problem.SolveGraduated(max_iterations, &best).ok())
    return problem.options().noise_model;
  best_seed->pose = problem.PoseAt(best);
  best_seed->log_focal = problem.LogFocalAt(best);
  return ScaledNoiseModel(problem, best);
}

// Every feature with the noise that it has in the refinement, for the closed forms.
void FillNoise(const EstimationOptions& options, const PointNoise& noise, Observations* resolved) {
  for (std::size_t i = 0; i < resolved->circles.size(); ++i) {
    double& sigma = resolved->circles[i].sigma_px;
    if (!(sigma > 0.0)) sigma = options.conic_loss.scale_px;
    if (!(sigma > 0.0)) sigma = noise.circles[i];
  }
  for (std::size_t i = 0; i < resolved->pencils.size(); ++i) {
    PencilObservation& pencil = resolved->pencils[i];
    for (std::size_t j = 0; j < pencil.lines.size(); ++j) {
      double& sigma = pencil.lines[j].sigma_px;
      if (!(sigma > 0.0)) sigma = pencil.sigma_px;
      if (!(sigma > 0.0)) sigma = options.line_loss.scale_px;
      if (!(sigma > 0.0)) sigma = noise.lines[i][j];
    }
  }
}

// Where the evidence is flat, solutions stop up to a tenth of a standard deviation apart.
bool IsSameMinimum(const JointProblem& problem, const Refined& a, const Refined& b) {
  constexpr double kSameSigmas = 0.1, kSameCost = 0.01;
  double tolerance = kSamePose;
  if (std::abs(a.hypothesis.cost - b.hypothesis.cost) < kSameCost) {
    const Eigen::Matrix3d covariance = a.hypothesis.Covariance().topLeftCorner<3, 3>();
    tolerance = std::max(tolerance, kSameSigmas * std::sqrt(covariance.diagonal().maxCoeff()));
  }
  return IsSamePose(problem, a.state, b.state, tolerance);
}

// Where the focal length is an unknown the posterior can be so flat that refinements stop at many
// places: those within a standard deviation of each other are one.
bool IsSameHump(const PoseHypothesis& a, const PoseHypothesis& b) {
  if (!(a.focal_sigma > 0.0) || !(b.focal_sigma > 0.0) || a.structure != b.structure) return false;
  const double sigma = std::min(a.focal_sigma / a.focal_scale, b.focal_sigma / b.focal_scale);
  if (!(std::abs(std::log(a.focal_scale / b.focal_scale)) <= sigma)) return false;
  const Eigen::Matrix3d &A = a.cam_from_world.rotation, &B = b.cam_from_world.rotation;
  // Of a rotation that is free about the normal the normals are compared.
  Eigen::Vector3d turn = LogRotation(A * B.transpose());
  if (a.RotationIsFree()) turn = A.col(2).cross(B.col(2));
  const Eigen::Vector3d variance =
      a.Covariance().diagonal().head<3>().cwiseMin(b.Covariance().diagonal().head<3>());
  return (turn.array().square() <= variance.array()).all();
}

// Hypotheses of all minima that compete, ranked.
Status FillHypotheses(const JointProblem& problem, const std::vector<State>& minima,
                      PoseEstimate* estimate) {
  double best = std::numeric_limits<double>::infinity();
  for (const State& minimum : minima) best = std::min(best, minimum.cost);
  const double most = best + problem.options().max_cost_gap;
  std::vector<Refined> all;
  Status last = Status::Failed("no seed pose could be refined");
  for (const State& minimum : minima) {
    if (minimum.cost > most) continue;
    Refined refined;
    const Status status = FillRefined(problem, minimum, &refined);
    if (!status.ok()) {
      last = status;
      continue;
    }
    const bool known = std::any_of(all.begin(), all.end(), [&](const Refined& r) {
      return IsSameMinimum(problem, r, refined);
    });
    if (known) continue;
    const auto hump = std::find_if(all.begin(), all.end(), [&](const Refined& r) {
      return IsSameHump(r.hypothesis, refined.hypothesis);
    });
    if (hump == all.end()) {
      all.push_back(std::move(refined));
    } else if (refined.hypothesis.cost < hump->hypothesis.cost) {
      *hump = std::move(refined);
    }
  }
  if (all.empty()) return last;
  const auto cheapest = std::min_element(all.begin(), all.end(), [](const auto& a, const auto& b) {
    return a.hypothesis.cost < b.hypothesis.cost;
  });
  estimate->notes.insert(estimate->notes.end(), cheapest->notes.begin(), cheapest->notes.end());
  constexpr double kAnySigmaPx = 0.5;  // Every feature has its own.
  for (Refined& refined : all) {
    CameraPose& pose = refined.hypothesis.cam_from_world;
    // A spin that nothing fixes is settled by convention, whatever the seed's was.
    if (problem.spin_is_free()) {
      WorldRotation(problem.observations(), pose.rotation.col(2), pose.translation, kAnySigmaPx,
                    &pose.rotation);
    }
    estimate->hypotheses.push_back(std::move(refined.hypothesis));
  }
  RankHypotheses(&estimate->hypotheses);
  return Status::Ok();
}

bool IsLeftOut(const std::string& id, const PoseHypothesis& hypothesis) {
  const std::vector<std::string>& out = hypothesis.left_out;
  return std::find(out.begin(), out.end(), id) != out.end();
}

// What it costs that a circle is none of the world's.
double StrangerCost(const JointProblem& problem, std::size_t circle) {
  State state;
  for (const Feature& f : problem.features()) {
    const bool is_it =
        f.kind == Feature::Kind::kCircle && f.observation == static_cast<int>(circle);
    state.active.push_back(is_it ? 0 : 1);
  }
  return LeftOutCost(problem, state);
}

// Hypotheses that take the second ellipse of a contour for the circle.
std::vector<PoseHypothesis> ReadSecond(const JointProblem& problem, const PointNoise& noise,
                                       const std::vector<std::shared_ptr<const Solver>>& seeders,
                                       std::size_t circle) {
  Observations other = problem.observations();
  CircleObservation& read = other.circles[circle];
  read.fit = read.second->fit;
  read.inliers = read.second->inliers;
  const JointProblem rival(other, problem.options(), noise);
  std::vector<std::string> unused;
  std::vector<State> minima;
  PoseEstimate estimate;
  if (!FindMinima(rival, AllSeeds(rival, other, seeders, &unused), &minima).ok() ||
      !FillHypotheses(rival, minima, &estimate).ok()) {
    return {};
  }
  // Both ellipses are in the photo: whichever is not taken is a stranger.
  const double other_stranger = StrangerCost(problem, circle) - StrangerCost(rival, circle);
  std::vector<PoseHypothesis> hypotheses;
  for (PoseHypothesis& h : estimate.hypotheses) {
    if (IsLeftOut(read.id, h)) continue;
    h.cost += other_stranger;
    h.structure += " + second of " + read.id;
    hypotheses.push_back(std::move(h));
  }
  return hypotheses;
}

// A circle that contradicts the rest may have been misread: of two rims on one contour the wrong
// one.
void AddSecondReadings(const JointProblem& problem, const PointNoise& noise,
                       const std::vector<std::shared_ptr<const Solver>>& seeders,
                       PoseEstimate* estimate) {
  std::vector<PoseHypothesis>& all = estimate->hypotheses;
  const std::vector<PoseHypothesis> first = all;
  for (std::size_t i = 0; i < problem.observations().circles.size(); ++i) {
    const CircleObservation& circle = problem.observations().circles[i];
    const auto contradicts = [&](const PoseHypothesis& h) { return IsLeftOut(circle.id, h); };
    if (!circle.second || std::none_of(first.begin(), first.end(), contradicts)) continue;
    const std::vector<PoseHypothesis> more = ReadSecond(problem, noise, seeders, i);
    all.insert(all.end(), more.begin(), more.end());
    estimate->notes.push_back("circle '" + circle.id +
                              "': tried as the second ellipse through its points, too");
  }
  if (all.size() == first.size()) return;
  RankHypotheses(&all);
  const double most = all.front().cost + problem.options().max_cost_gap;
  all.erase(std::remove_if(all.begin(), all.end(),
                           [most](const PoseHypothesis& h) { return h.cost > most; }),
            all.end());
}

Status RefineResolved(const Observations& resolved, const PointNoise& noise,
                      const std::vector<std::shared_ptr<const Solver>>& seeders,
                      const EstimationOptions& options, PoseEstimate* estimate) {
  const JointProblem as_stated(resolved, options, noise);
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
    scaled.emplace(resolved, scaled_options, noise);
  }
  const JointProblem& problem = scaled ? *scaled : as_stated;
  std::vector<State> minima;
  const Status status = FindMinima(problem, seeds, &minima);
  if (!status.ok()) {
    reasons.insert(reasons.begin(), "no pose agrees with all evidence: " + status.message);
    return NoSeed(resolved, reasons);
  }
  const Status filled = FillHypotheses(problem, minima, estimate);
  if (filled.ok()) AddSecondReadings(problem, noise, seeders, estimate);
  return filled;
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

  constexpr double kDefaultSigmaPx = 0.4;  // For fits that nobody has made yet.
  Observations resolved = ResolveWorld(observations);
  FitDirect(options.line_loss.scale_px > 0.0 ? options.line_loss.scale_px : kDefaultSigmaPx,
            &resolved, &estimate.notes);
  resolved = ResolveWorld(resolved);
  const PointNoise noise = MeasurePointNoise(resolved, options.noise_model);
  FillNoise(options, noise, &resolved);
  estimate.status = RefineResolved(resolved, noise, seeders, options, &estimate);
  if (estimate.status.ok()) estimate.decided_by = DecidedBy(estimate.hypotheses);
  return estimate;
}

}  // namespace circline
