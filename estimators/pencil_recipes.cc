#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "circline/estimators/closed_form_recipes.h"

namespace circline {
namespace {

using PencilPair = std::array<PencilObservation, 2>;

// Whether two pencils have different directions: they run along different axes, are known to make
// an angle, or are measured more than three standard deviations apart.
bool Differ(const PencilObservation& a, const PencilObservation& b,
            const std::vector<KnownAngle>& known_angles) {
  constexpr double kGate = 3.0, kRounding = 1e-9;
  if (!(a.fit->direction.cross(b.fit->direction).norm() > kRounding)) return false;
  if (RunsAlongAxis(a) && RunsAlongAxis(b)) return a.direction != b.direction;
  const KnownAngle* known = FindKnownAngle(known_angles, a.id, b.id);
  if (known != nullptr && std::abs(std::sin(known->value)) > kGate * known->sigma) return true;
  return DirectionSeparation(*a.fit, *b.fit) > kGate;
}

// The first two pencils of different directions. Those of two different axes are tried first, then
// those with one.
Status FirstPair(std::vector<PencilObservation> pencils,
                 const std::vector<KnownAngle>& known_angles, PencilPair* pair) {
  std::stable_partition(pencils.begin(), pencils.end(), RunsAlongAxis);
  for (std::size_t i = 0; i < pencils.size(); ++i) {
    for (std::size_t j = i + 1; j < pencils.size(); ++j) {
      if (!Differ(pencils[i], pencils[j], known_angles)) continue;
      *pair = {pencils[i], pencils[j]};
      return Status::Ok();
    }
  }
  if (pencils.size() > 1) {
    return Status::Refused(
        "the pencils '" + pencils[0].id + "' and '" + pencils[1].id +
        "' have the same direction within their uncertainty; they span no plane");
  }
  return Status::Refused(pencils.empty() ? "there is no pencil of two or more parallel lines"
                                         : "there is only one pencil of parallel lines ('" +
                                               pencils[0].id + "'); a second direction is needed");
}

// Keeps the pair, and what is known of it and of the frame's plane, without circles.
void KeepPencils(const PencilPair& pair, const FrameObservation& frame,
                 const Observations& observations, Observations* evidence) {
  *evidence = KeepFrame(observations, frame);
  evidence->frame.origin_is_center.clear();
  evidence->pencils = {pair[0], pair[1]};
  for (const KnownAngle& known : observations.known_angles) {
    if (IsBetween(known, pair[0].id, pair[1].id)) evidence->known_angles.push_back(known);
  }
}

// Two fitted pencils that fix the world frame: along its axes, or in its plane. Where only pencils
// that are tied to nothing can be had, they span a plane of their own, "pencils".
Status SelectPencils(const Observations& observations, Observations* evidence) {
  std::vector<PencilObservation> of_world, fitted;
  for (const PencilObservation& pencil : observations.pencils) {
    if (!pencil.fit) continue;
    fitted.push_back(pencil);
    if (RunsAlongAxis(pencil) || pencil.plane == observations.frame.plane)
      of_world.push_back(pencil);
  }
  PencilPair pair;
  FrameObservation frame = observations.frame;
  if (!FirstPair(of_world, observations.known_angles, &pair).ok()) {
    const Status status = FirstPair(fitted, observations.known_angles, &pair);
    if (!status.ok()) return status;
    frame = FrameObservation();
    frame.plane = pair[0].plane = pair[1].plane = "pencils";
    pair[0].direction = PencilDirection::kX;
    pair[1].direction = PencilDirection::kFree;
  }
  KeepPencils(pair, frame, observations, evidence);
  return Status::Ok();
}

Status SelectPencilsAlongAxes(const Observations& observations, Observations* evidence) {
  std::vector<PencilObservation> along_axes;
  for (const PencilObservation& pencil : observations.pencils) {
    if (pencil.fit && RunsAlongAxis(pencil)) along_axes.push_back(pencil);
  }
  PencilPair pair;
  const Status status = FirstPair(along_axes, observations.known_angles, &pair);
  if (!status.ok()) return Status::Refused("of the pencils along an axis: " + status.message);
  KeepPencils(pair, observations.frame, observations, evidence);
  return Status::Ok();
}

Status GatherPencils(const Observations& evidence, double sigma_px, bool axes_are_orthogonal,
                     Inputs* inputs) {
  GatherFrame(evidence, sigma_px, inputs);
  GatherDirections(evidence, axes_are_orthogonal, inputs);
  GatherDrawnAxes(evidence, sigma_px, inputs);
  if (inputs->origin.present()) return Status::Ok();
  // The origin: where the axes cross, or by convention where the first lines of the pencils do.
  const auto line = [&](const Measured& axis, std::size_t i) -> Eigen::Vector3d {
    if (axis.present()) return axis.value;
    for (const LineObservation& l : evidence.pencils[i].lines) {
      if (l.fit && l.is_parallel) return l.fit->line;
    }
    return Eigen::Vector3d::Zero();
  };
  const bool y_first =
      inputs->roles[0] == PencilDirection::kY || inputs->roles[1] == PencilDirection::kX;
  const std::size_t x = y_first ? 1 : 0;
  Eigen::Vector3d crossing = line(inputs->x_line, x).cross(line(inputs->y_line, 1 - x));
  const bool is_finite = std::abs(crossing.z()) > 1e-9 * crossing.norm();
  if (!is_finite) crossing = Eigen::Vector3d::UnitZ();
  inputs->origin_observed = is_finite && inputs->DrawnAxesCross();
  inputs->origin.value = crossing / crossing.z();
  inputs->origin.columns = Eigen::MatrixXd::Zero(3, 0);
  return Status::Ok();
}

}  // namespace

Observations KeepFrame(const Observations& observations, const FrameObservation& frame) {
  Observations evidence;
  evidence.camera = observations.camera;
  evidence.stated_focal_px = observations.stated_focal_px;
  evidence.found_k1 = observations.found_k1;
  evidence.frame = frame;
  for (const KnownLength& known : observations.known_lengths) {
    if (IsInWorldPlane(known, evidence)) evidence.known_lengths.push_back(known);
  }
  return evidence;
}

std::vector<Recipe> PencilRecipes() {
  const auto gather = [](bool axes_are_orthogonal) {
    return [=](const Observations& evidence, double sigma_px, Inputs* inputs) {
      return GatherPencils(evidence, sigma_px, axes_are_orthogonal, inputs);
    };
  };
  // Proposition 5 makes no use of what the axes are.
  return {{"orthogonal_vanishing_points", "two pencils of parallel lines along two of the axes", "",
           SelectPencilsAlongAxes, gather(true), OrthogonalDirectionPoses},
          {"line_pairs", "two pencils of parallel lines, two or more lines each", "", SelectPencils,
           gather(false), LinePairPoses}};
}

}  // namespace circline
