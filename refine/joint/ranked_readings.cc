#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <string>
#include <utility>

#include "circline/estimators/closed_form_solvers.h"
#include "circline/refine/joint/joint_result.h"
#include "circline/refine/joint/readings.h"

namespace circline {
namespace {

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

// Hypotheses of all minima that compete.
Status FillHypotheses(const JointProblem& problem, const std::vector<State>& minima,
                      std::vector<Refined>* hypotheses) {
  const auto best = std::min_element(minima.begin(), minima.end(), HasLessCost);
  std::vector<Refined>& all = *hypotheses;
  Status last = Status::Failed("no seed pose could be refined");
  for (const State& minimum : minima) {
    if (minimum.cost > best->cost + problem.options().max_cost_gap) continue;
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
    all.push_back(std::move(refined));
    CameraPose& pose = all.back().hypothesis.cam_from_world;
    // A spin that nothing fixes is settled by convention, whatever the seed's was.
    if (problem.SpinIsFree(all.back().state)) {
      WorldRotation(problem.observations(), pose.rotation.col(2), pose.translation, kAnySigmaPx,
                    &pose.rotation);
    }
  }
  return all.empty() ? last : Status::Ok();
}

std::vector<PoseHypothesis> Ranked(const std::vector<Refined>& all) {
  std::vector<PoseHypothesis> hypotheses;
  for (const Refined& refined : all) hypotheses.push_back(refined.hypothesis);
  RankHypotheses(&hypotheses);
  return hypotheses;
}

// In PoseHypothesis::structure.
std::string SecondOf(const std::string& id) { return " + second of " + id; }

bool IsLeftOut(const std::string& id, const PoseHypothesis& hypothesis) {
  const std::vector<std::string>& out = hypothesis.left_out;
  return std::find(out.begin(), out.end(), id) != out.end();
}

// Hypotheses that take the second ellipse of a contour for the circle, from the poses that are
// known.
std::vector<Refined> ReadSecond(const JointProblem& problem, const std::vector<Refined>& known,
                                std::size_t circle) {
  Observations other = problem.observations();
  CircleObservation& read = other.circles[circle];
  read.fit = read.second->fit;
  read.inliers = read.second->inliers;
  const JointProblem rival(other, problem.options());
  std::vector<Seed> seeds;
  for (const Refined& refined : known)
    seeds.push_back({problem.PoseAt(refined.state), problem.LogFocalAt(refined.state), 1});
  std::vector<State> minima;
  std::vector<Refined> all, made;
  if (!FindMinima(rival, seeds, &minima).ok() || !FillHypotheses(rival, minima, &all).ok())
    return made;
  for (Refined& refined : all) {
    if (IsLeftOut(read.id, refined.hypothesis)) continue;
    refined.hypothesis.structure += SecondOf(read.id);
    made.push_back(std::move(refined));
  }
  return made;
}

// The circles with a second ellipse that hypotheses leave out, the most probably left out first.
std::vector<std::size_t> LeftOutWithSecond(const JointProblem& problem,
                                           const std::vector<PoseHypothesis>& hypotheses) {
  constexpr double kNegligible = 1e-3;     // Probability of being left out.
  constexpr std::size_t kMostCircles = 3;  // Each is solved anew.
  std::vector<std::pair<double, std::size_t>> found;
  for (std::size_t i = 0; i < problem.observations().circles.size(); ++i) {
    const CircleObservation& circle = problem.observations().circles[i];
    double probability = 0.0;
    for (const PoseHypothesis& h : hypotheses)
      probability += circle.second && IsLeftOut(circle.id, h) ? h.probability : 0.0;
    if (probability > kNegligible) found.emplace_back(probability, i);
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  found.resize(std::min(found.size(), kMostCircles));
  std::vector<std::size_t> circles;
  for (const auto& [probability, i] : found) circles.push_back(i);
  return circles;
}

// A circle that contradicts the rest may have been misread: of two rims on one contour the wrong
// one. Returns the circles that were read again.
std::vector<std::size_t> AddSecondReadings(const JointProblem& problem, std::vector<Refined>* all) {
  const std::vector<std::size_t> circles = LeftOutWithSecond(problem, Ranked(*all));
  if (circles.empty()) return circles;
  const std::vector<Refined> first = *all;
  for (const std::size_t i : circles) {
    std::vector<Refined> more = ReadSecond(problem, first, i);
    std::move(more.begin(), more.end(), std::back_inserter(*all));
  }
  const auto cost = [](const Refined& r) { return r.hypothesis.cost; };
  double most = problem.options().max_cost_gap;
  most += cost(*std::min_element(all->begin(), all->end(), [&](const Refined& a, const Refined& b) {
    return cost(a) < cost(b);
  }));
  all->erase(
      std::remove_if(all->begin(), all->end(), [&](const Refined& r) { return cost(r) > most; }),
      all->end());
  return circles;
}

// In words, where most points are outliers of a pose; else empty.
std::string FewInliers(const PoseHypothesis& h) {
  if (2 * h.num_inliers >= h.num_observations) return "";
  return "only " + std::to_string(h.num_inliers) + " of " + std::to_string(h.num_observations) +
         " points agree with the pose to three standard deviations: a noise that is stated "
         "(sigma_px) "
         "may be too small";
}

}  // namespace

Status RankReadings(const JointProblem& problem, const std::vector<State>& minima,
                    PoseEstimate* estimate) {
  std::vector<Refined> all;
  const Status status = FillHypotheses(problem, minima, &all);
  if (!status.ok()) return status;
  const std::vector<std::size_t> read_again = AddSecondReadings(problem, &all);
  CountCircleVolumes(&all);
  estimate->hypotheses = Ranked(all);
  MergeHumps(&estimate->hypotheses);
  const PoseHypothesis& best = estimate->hypotheses.front();
  const auto notes_of = std::find_if(all.begin(), all.end(), [&](const Refined& r) {
    return r.hypothesis.cost == best.cost && r.hypothesis.structure == best.structure;
  });
  for (const std::string& note : {FocalNote(problem, best), FewInliers(best)})
    if (!note.empty()) estimate->notes.push_back(note);
  if (notes_of != all.end())
    estimate->notes.insert(estimate->notes.end(), notes_of->notes.begin(), notes_of->notes.end());
  for (const std::size_t i : read_again) {
    const std::string& id = problem.observations().circles[i].id;
    const bool is_best = best.structure.find(SecondOf(id)) != std::string::npos;
    estimate->notes.push_back("circle '" + id +
                              "': tried as the second ellipse through its points, too, which the "
                              "best pose " +
                              (is_best ? "takes" : "does not take"));
  }
  // What is known of the pose beforehand speaks against turns, too, and is not in the readings.
  if (!problem.options().pose_prior && !problem.options().gravity_prior)
    ShareByReadings(problem.observations(), &estimate->hypotheses);
  return Status::Ok();
}

}  // namespace circline
