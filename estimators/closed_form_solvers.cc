#include "circline/estimators/closed_form_solvers.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <utility>

#include "circline/estimators/basics.h"
#include "circline/estimators/closed_form_errors.h"
#include "circline/estimators/closed_form_recipes.h"
#include "circline/estimators/directions.h"

namespace circline {
namespace {

// Whether neither an axis nor a direction is known: the turn about the normal is then free.
bool SpinIsFree(const Inputs& inputs) {
  return !inputs.x_line.present() && !inputs.y_line.present() && !inputs.directions[0].present();
}

// The first few problems, to be added to a sentence.
std::string Because(const std::vector<std::string>& problems) {
  constexpr std::size_t kMost = 3;
  std::string text;
  for (std::size_t i = 0; i < std::min(problems.size(), kMost); ++i) {
    text += (i == 0 ? " (" : "; ") + problems[i];
  }
  if (problems.size() > kMost) text += "; " + std::to_string(problems.size() - kMost) + " more";
  return text.empty() ? text : text + ")";
}

// Counts and rms of the fits that a hypothesis rests on.
void FillSupport(const Observations& evidence, PoseHypothesis* h) {
  double squares = 0.0;
  const auto add = [&](double rms, const std::vector<Eigen::Vector2d>& points,
                       const std::vector<std::uint8_t>& mask, bool counts) {
    const int outliers = static_cast<int>(std::count(mask.begin(), mask.end(), 0));
    const int inliers = counts ? static_cast<int>(points.size()) - outliers : 0;
    squares += rms * rms * inliers;
    h->num_inliers += inliers;
    h->num_observations += static_cast<int>(points.size());
  };
  for (const CircleObservation& c : evidence.circles) {
    if (c.fit) add(c.fit->rms_px, c.points, c.inliers, true);
  }
  for (const PencilObservation& pencil : evidence.pencils) {
    for (const LineObservation& line : pencil.lines) {
      if (line.fit) add(line.fit->rms_px, line.points, line.inliers, line.is_parallel);
    }
    if (pencil.fit) {
      h->pencils.push_back(
          {pencil.id, pencil.fit->direction, LargestSigmaDeg(pencil.fit->covariance)});
    }
  }
  if (h->num_inliers > 0) h->rms_px = std::sqrt(squares / h->num_inliers);
}

// What two pencils say beside the pose: the angle between them, with its standard deviation.
std::string AngleBetween(const PencilObservation& a, const PencilObservation& b) {
  const Eigen::Vector3d u = a.fit->direction;
  const Eigen::Vector3d v = b.fit->direction * (u.dot(b.fit->direction) < 0.0 ? -1.0 : 1.0);
  const Eigen::Vector3d n = u.cross(v).normalized();
  // Each direction counts with what it moves within the common plane.
  const Eigen::Vector3d du = n.cross(u), dv = n.cross(v);
  const double variance = du.dot(a.fit->covariance * du) + dv.dot(b.fit->covariance * dv);
  char text[160];
  std::snprintf(text, sizeof(text), "' are %.2f +- %.2f degrees apart",
                std::atan2(u.cross(v).norm(), u.dot(v)) / kDegree,
                std::sqrt(std::max(0.0, variance)) / kDegree);
  return "the directions of '" + a.id + "' and '" + b.id + text;
}

void FillCircle(const Observations& evidence, const CirclePose& pose, PoseHypothesis* h) {
  // CirclePose counts in radii; the hypothesis' unit is metric, or makes the translation a unit
  // vector.
  const Eigen::Vector3d n = h->cam_from_world.rotation.col(2);
  const double distance = std::abs(n.dot(h->cam_from_world.translation));
  const double unit = distance / std::abs(pose.normal.dot(pose.center));
  CircleEstimate estimate;
  estimate.id = evidence.circles.front().id;
  estimate.normal = pose.normal;
  estimate.center = unit * pose.center;
  estimate.radius = unit;
  CameraToPixel(evidence.camera, pose.center, &estimate.center_px);
  h->circles.push_back(estimate);
}

// One closed form as a registered solver: a recipe, completed by ranking and propagated covariance.
class ClosedFormSolver : public Solver {
 public:
  ClosedFormSolver(Recipe recipe, const ClosedFormOptions& options)
      : recipe_(std::move(recipe)), options_(options) {}

  const std::string& name() const override { return recipe_.name; }
  SolverStage stage() const override { return SolverStage::kClosedForm; }
  std::string needs() const override { return recipe_.needs; }
  Observations Evidence(const Observations& observations) const override;
  PoseEstimate Solve(const Observations& observations) const override;
  PoseEstimate Seeds(const Observations& resolved) const override;

 private:
  // Fitted and with a world frame; `problems`: see FitDirect.
  Observations Resolved(const Observations& observations,
                        std::vector<std::string>* problems = nullptr) const;
  // The recipe's inputs with the errors of the noise model; that of a line against its pencil's
  // direction goes into the covariances of the evidence's lines.
  Status Gather(Observations* evidence, Inputs* inputs) const;

  Recipe recipe_;
  ClosedFormOptions options_;
};

Observations ClosedFormSolver::Evidence(const Observations& observations) const {
  Observations evidence;
  recipe_.select(Resolved(observations), &evidence);
  return evidence;
}

PoseEstimate ClosedFormSolver::Solve(const Observations& observations) const {
  PoseEstimate estimate;
  estimate.solver = recipe_.name;
  estimate.status = options_.Validate();
  if (estimate.status.ok()) estimate.status = observations.Validate();
  if (!estimate.status.ok()) return estimate;
  Observations evidence;
  estimate.status = recipe_.select(Resolved(observations, &estimate.notes), &evidence);
  // What could not be fitted may be what is missing.
  if (!estimate.status.ok()) estimate.status.message += Because(estimate.notes);
  Inputs inputs;
  if (estimate.status.ok()) estimate.status = Gather(&evidence, &inputs);
  if (!estimate.status.ok()) return estimate;

  const std::vector<Candidate> candidates = recipe_.evaluate(inputs);
  const std::vector<Perturbation> errors =
      Perturbations(inputs.Moved(), options_.noise_model, evidence.camera);
  const auto perturbed = [&](std::size_t error, double part) {
    Inputs moved = inputs;
    errors[error](part, moved.Moved());
    return recipe_.evaluate(moved);
  };
  estimate.hypotheses =
      WithUncertainty(candidates, perturbed, errors.size(), inputs.IsMetric(), SpinIsFree(inputs));
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    PoseHypothesis& h = estimate.hypotheses[i];
    h.origin_observed = inputs.origin_observed;
    FillSupport(evidence, &h);
    if (candidates[i].circle) FillCircle(evidence, *candidates[i].circle, &h);
  }
  if (evidence.pencils.size() == 2 && evidence.pencils[0].fit && evidence.pencils[1].fit) {
    estimate.notes.push_back(AngleBetween(evidence.pencils[0], evidence.pencils[1]));
  }
  if (estimate.hypotheses.empty()) {
    estimate.status = Status::Refused(recipe_.name + ": the evidence is degenerate (" +
                                      recipe_.needs + " are needed)");
    return estimate;
  }
  RankHypotheses(&estimate.hypotheses);
  estimate.decided_by = estimate.hypotheses.size() > 1 ? recipe_.decided_by : "only one pose fits";
  return estimate;
}

PoseEstimate ClosedFormSolver::Seeds(const Observations& resolved) const {
  PoseEstimate estimate;
  estimate.solver = recipe_.name;
  Observations evidence;
  Inputs inputs;
  estimate.status = recipe_.select(resolved, &evidence);
  if (estimate.status.ok() && evidence.frame.plane != resolved.frame.plane)
    estimate.status = Status::Refused("nothing ties its evidence to the world's plane");
  if (estimate.status.ok()) estimate.status = Gather(&evidence, &inputs);
  if (!estimate.status.ok()) return estimate;
  for (const Candidate& candidate : recipe_.evaluate(inputs))
    estimate.hypotheses.push_back(
        WithoutUncertainty(candidate, inputs.IsMetric(), SpinIsFree(inputs)));
  if (estimate.hypotheses.empty())
    estimate.status = Status::Refused(recipe_.name + ": the evidence is degenerate");
  return estimate;
}

Observations ClosedFormSolver::Resolved(const Observations& observations,
                                        std::vector<std::string>* problems) const {
  Observations fitted = observations;
  FitDirect(options_.sigma_px, &fitted, problems, options_.noise_model);
  return ResolveWorld(fitted);
}

Status ClosedFormSolver::Gather(Observations* evidence, Inputs* inputs) const {
  for (PencilObservation& pencil : evidence->pencils) {
    if (pencil.lines.size() == 1) continue;  // An axis.
    for (LineObservation& line : pencil.lines) {
      if (line.fit)
        line.fit = WithDirectionError(*line.fit, options_.noise_model.line_direction_rad);
    }
  }
  const Status status = recipe_.gather(*evidence, options_.sigma_px, inputs);
  if (status.ok()) AddModelErrors(options_.noise_model, inputs);
  return status;
}

}  // namespace

Status ClosedFormOptions::Validate() const {
  if (!(sigma_px > 0.0) || !std::isfinite(sigma_px))
    return Status::Invalid("sigma_px must be positive");
  return noise_model.Validate();
}

bool WorldRotation(const Observations& observations, const Eigen::Vector3d& normal,
                   const Eigen::Vector3d& plane_ray, double sigma_px, Eigen::Matrix3d* rotation) {
  Inputs inputs;
  GatherFrame(observations, sigma_px, &inputs);
  GatherAxisLines(observations, sigma_px, &inputs);
  return RotationOfPlane(normal, plane_ray, inputs, rotation);
}

void AddClosedFormSolvers(SolverRegistry* registry, const ClosedFormOptions& options) {
  for (const std::vector<Recipe>& recipes : {PencilRecipes(), CircleRecipes()}) {
    for (const Recipe& recipe : recipes) {
      registry->Add(std::make_shared<ClosedFormSolver>(recipe, options));
    }
  }
}

}  // namespace circline
