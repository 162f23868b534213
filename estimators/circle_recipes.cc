#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "circline/estimators/circle_planes.h"
#include "circline/estimators/closed_form_recipes.h"

namespace circline {
namespace {

// Largest extent of a contour, pixels: the larger the circle, the more it says.
double Extent(const CircleObservation& circle) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& p : circle.points) box.extend(p);
  return circle.points.empty() ? 0.0 : box.diagonal().norm();
}

using CircleTest = std::function<bool(const CircleObservation&)>;

// Fitted circles of the world plane that pass the test, the largest first.
std::vector<const CircleObservation*> WorldCircles(const Observations& observations,
                                                   const CircleTest& test) {
  std::vector<std::pair<double, const CircleObservation*>> sized;
  for (const CircleObservation& circle : observations.circles) {
    if (circle.fit && circle.plane == observations.frame.plane && test(circle))
      sized.emplace_back(Extent(circle), &circle);
  }
  std::stable_sort(sized.begin(), sized.end(),
                   [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<const CircleObservation*> circles;
  for (const auto& [extent, circle] : sized) circles.push_back(circle);
  return circles;
}

// Copies of the first ones.
std::vector<CircleObservation> Copies(const std::vector<const CircleObservation*>& circles,
                                      std::size_t most) {
  std::vector<CircleObservation> copies;
  for (std::size_t i = 0; i < std::min(most, circles.size()); ++i) copies.push_back(*circles[i]);
  return copies;
}

// Camera, frame and known lengths of the world plane, and `circles`.
Observations KeepCircles(const Observations& observations, std::vector<CircleObservation> circles) {
  Observations evidence;
  evidence.camera = observations.camera;
  evidence.frame = observations.frame;
  const std::string& origin = evidence.frame.origin_is_center;
  if (std::none_of(circles.begin(), circles.end(), [&](const auto& c) { return c.id == origin; })) {
    evidence.frame.origin_is_center.clear();
  }
  for (const KnownLength& known : observations.known_lengths) {
    if (IsInWorldPlane(known, evidence)) evidence.known_lengths.push_back(known);
  }
  evidence.circles = std::move(circles);
  return evidence;
}

// Without what would place their centres.
std::vector<CircleObservation> Bare(std::vector<CircleObservation> circles) {
  for (CircleObservation& circle : circles) {
    circle.center.reset();
    circle.diameters.clear();
  }
  return circles;
}

// Keeps the largest circle, its contour alone.
Status SelectBareCircle(const Observations& observations, Observations* evidence) {
  const auto circles = WorldCircles(observations, [](const auto&) { return true; });
  if (circles.empty()) return Status::Refused("no circle of the world's plane could be fitted");
  *evidence = KeepCircles(observations, Bare(Copies(circles, 1)));
  return Status::Ok();
}

// Keeps the single line of a pencil that an axis is drawn on, as a pencil of its own.
void KeepAxisLine(const Observations& observations, const std::optional<Segment>& axis,
                  PencilDirection direction, Observations* evidence) {
  int pencil, line;
  if (!axis || !FindAxisLine(observations, *axis, &pencil, &line)) return;
  PencilObservation kept = observations.pencils[static_cast<std::size_t>(pencil)];
  kept.lines = {kept.lines[static_cast<std::size_t>(line)]};
  kept.direction = direction;
  kept.fit.reset();
  evidence->pencils.push_back(std::move(kept));
}

// The lines that carry the drawn axes fix the rotation about the normal.
void KeepAxisLines(const Observations& observations, Observations* evidence) {
  KeepAxisLine(observations, observations.frame.x_axis, PencilDirection::kX, evidence);
  KeepAxisLine(observations, observations.frame.y_axis, PencilDirection::kY, evidence);
}

Recipe SingleCircleRecipe() {
  Recipe r;
  r.name = "single_circle";
  r.needs = "a circle";
  r.decided_by = "nothing: a circle alone has two poses";
  r.select = [](const Observations& observations, Observations* evidence) {
    const Status status = SelectBareCircle(observations, evidence);
    evidence->frame = FrameObservation();
    evidence->frame.plane = observations.frame.plane;
    evidence->known_lengths.clear();
    return status;
  };
  r.gather = [](const Observations& evidence, double sigma_px, Inputs* inputs) {
    GatherCircle(evidence, evidence.circles.front(), sigma_px, inputs);
    return Status::Ok();
  };
  r.evaluate = SingleCirclePoses;
  return r;
}

// One circle whose centre is known somehow: `has_center` says of which circles, `gather_center`
// fills Inputs::center.
Recipe CenterRecipe(
    const std::string& name, const std::string& needs, const std::string& decided_by,
    const std::function<bool(const Observations&, const CircleObservation&)>& has_center,
    const std::function<Status(const Observations&, double, Inputs*)>& gather_center) {
  Recipe r;
  r.name = name;
  r.needs = needs;
  r.decided_by = decided_by;
  r.select = [has_center, needs](const Observations& observations, Observations* evidence) {
    const auto circles = WorldCircles(
        observations, [&](const auto& circle) { return has_center(observations, circle); });
    if (circles.empty()) return Status::Refused("the world's plane does not hold " + needs);
    *evidence = KeepCircles(observations, Copies(circles, 1));
    KeepAxisLines(observations, evidence);
    return Status::Ok();
  };
  r.gather = [gather_center](const Observations& evidence, double sigma_px, Inputs* inputs) {
    GatherFrame(evidence, sigma_px, inputs);
    GatherCircle(evidence, evidence.circles.front(), sigma_px, inputs);
    GatherDrawnAxes(evidence, sigma_px, inputs);
    return gather_center(evidence, sigma_px, inputs);
  };
  r.evaluate = CircleCenterPoses;
  return r;
}

Recipe CircleCenterRecipe() {
  return CenterRecipe(
      "circle_center", "a circle and the image of its centre", "the image of the circle's centre",
      [](const Observations& observations, const CircleObservation& circle) {
        return circle.center || (observations.frame.origin && !circle.id.empty() &&
                                 observations.frame.origin_is_center == circle.id);
      },
      [](const Observations& evidence, double, Inputs* inputs) {
        return inputs->center.present()
                   ? Status::Ok()
                   : Status::Refused("the centre of circle '" + evidence.circles.front().id +
                                     "' lies where the camera model cannot undistort it");
      });
}

Recipe CircleDiametersRecipe() {
  return CenterRecipe(
      "circle_diameters", "a circle and two or more chords through its centre",
      "the crossing of the diameters",
      [](const Observations&, const CircleObservation& circle) {
        return circle.diameters.size() >= 2;
      },
      [](const Observations& evidence, double sigma_px, Inputs* inputs) {
        const CircleObservation& circle = evidence.circles.front();
        return GatherDiameters(evidence.camera, circle, sigma_px, &inputs->center);
      });
}

// Inverse variance of the normal, rad^2, of the first of a circle's planes.
double NormalWeight(const Measured& conic) {
  constexpr double kRounding = 1e-18;
  std::array<CirclePlane, 2> planes;
  CirclePlanes(conic.value, conic.columns, &planes);
  return 1.0 / (planes[0].covariance.trace() + kRounding);
}

Status GatherCircles(const Observations& evidence, double sigma_px, Inputs* inputs) {
  GatherFrame(evidence, sigma_px, inputs);
  GatherCircle(evidence, evidence.circles.front(), sigma_px, inputs);
  GatherDrawnAxes(evidence, sigma_px, inputs);
  for (std::size_t i = 1; i < evidence.circles.size(); ++i) {
    GatherConic(evidence.circles[i], &inputs->more_conics.emplace_back(), inputs);
  }
  inputs->normal_weights = {NormalWeight(inputs->conic)};
  for (const Measured& conic : inputs->more_conics)
    inputs->normal_weights.push_back(NormalWeight(conic));
  return Status::Ok();
}

// More circles add little to the choice of the plane, and the joint refinement uses them all.
constexpr std::size_t kMaxCircles = 12;

Recipe ParallelCirclesRecipe() {
  Recipe r;
  r.name = "parallel_circles";
  r.needs = "two or more circles of one plane";
  r.decided_by = "the plane that the circles have in common";
  r.select = [](const Observations& observations, Observations* evidence) {
    const auto found = WorldCircles(observations, [](const auto&) { return true; });
    if (found.size() < 2) {
      return Status::Refused("the world's plane holds fewer than two fitted circles");
    }
    std::vector<CircleObservation> circles = Bare(Copies(found, kMaxCircles));
    for (CircleObservation& circle : circles) circle.concentric.clear();
    *evidence = KeepCircles(observations, std::move(circles));
    KeepAxisLines(observations, evidence);
    return Status::Ok();
  };
  r.gather = GatherCircles;
  r.evaluate = ParallelCirclePoses;
  return r;
}

Recipe ConcentricCirclesRecipe() {
  Recipe r;
  r.name = "concentric_circles";
  r.needs = "two or more concentric circles";
  r.decided_by = "the plane and centre that the circles have in common";
  r.select = [](const Observations& observations, Observations* evidence) {
    for (const CircleObservation* first :
         WorldCircles(observations, [](const auto& c) { return !c.concentric.empty(); })) {
      const auto circles = WorldCircles(
          observations, [first](const auto& c) { return c.concentric == first->concentric; });
      if (circles.size() < 2) continue;
      *evidence = KeepCircles(observations, Bare(Copies(circles, circles.size())));
      KeepAxisLines(observations, evidence);
      return Status::Ok();
    }
    return Status::Refused("the world's plane holds no two fitted circles that are concentric");
  };
  r.gather = GatherCircles;
  r.evaluate = ConcentricCirclePoses;
  return r;
}

Status GatherAxes(const Observations& evidence, double sigma_px, Inputs* inputs) {
  GatherAxisLines(evidence, sigma_px, inputs);
  if (!inputs->x_line.present() || !inputs->y_line.present()) {
    return Status::Refused(std::string("there is no image of the ") +
                           (inputs->x_line.present() ? "Y" : "X") +
                           " axis, nor of a line of the plane along it");
  }
  return Status::Ok();
}

Recipe CircleFrameRecipe() {
  Recipe r;
  r.name = "circle_frame";
  r.needs = "a circle and the images of the X and Y axes of its plane";
  r.decided_by = "the right angle between the axes";
  r.select = [](const Observations& observations, Observations* evidence) {
    const Status status = SelectBareCircle(observations, evidence);
    if (!status.ok()) return status;
    if (observations.frame.x_axis && observations.frame.y_axis) {
      KeepAxisLines(observations, evidence);
      return Status::Ok();
    }
    for (const PencilObservation& pencil : observations.pencils) {
      const bool along_axis =
          pencil.direction == PencilDirection::kX || pencil.direction == PencilDirection::kY;
      if (along_axis) evidence->pencils.push_back(pencil);
    }
    return Status::Ok();
  };
  r.gather = [](const Observations& evidence, double sigma_px, Inputs* inputs) {
    GatherFrame(evidence, sigma_px, inputs);
    GatherCircle(evidence, evidence.circles.front(), sigma_px, inputs);
    return GatherAxes(evidence, sigma_px, inputs);
  };
  r.evaluate = CircleFramePoses;
  return r;
}

}  // namespace

Status GatherDiameters(const Camera& camera, const CircleObservation& circle, double sigma_px,
                       Measured* center) {
  const double sigma = circle.sigma_px > 0.0 ? circle.sigma_px : sigma_px;
  std::vector<LineFit> chords;
  for (const Segment& diameter : circle.diameters) {
    std::vector<CalibratedPoint> points;
    LineFit fit;
    PixelsToCalibrated(camera, {diameter[0], diameter[1]}, &points);
    if (FitLine(points, sigma, &fit).ok()) chords.push_back(fit);
  }
  VanishingPointFit crossing;
  const Status status = FitVanishingPoint(chords, &crossing);
  if (!status.ok()) {
    return Status::Refused("the diameters of circle '" + circle.id +
                           "' do not cross in one point: " + status.message);
  }
  if (crossing.direction.z() < 0.0) crossing.direction = -crossing.direction;
  *center = Measured(crossing.direction, crossing.covariance);
  return Status::Ok();
}

std::vector<Recipe> CircleRecipes() {
  return {SingleCircleRecipe(),      CircleCenterRecipe(),    CircleDiametersRecipe(),
          ConcentricCirclesRecipe(), ParallelCirclesRecipe(), CircleFrameRecipe()};
}

}  // namespace circline
