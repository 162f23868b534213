// The closed forms of circles: which evidence each one uses, and what it reads of it.
#include <Eigen/Geometry>
#include <array>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "circline/estimators/circle_planes.h"
#include "circline/estimators/closed_form_recipes.h"

namespace circline {
namespace {

using Circles = std::vector<CircleObservation>;

// Largest extent of a contour, pixels: the larger the circle, the more it says.
double ContourExtent(const CircleObservation& circle) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& p : circle.points) box.extend(p);
  return circle.points.empty() ? 0.0 : box.diagonal().norm();
}

// Fitted circles of the world plane that pass the test, the largest first; copies of so many.
template <typename Test>
Circles WorldCircles(const Observations& observations, std::size_t most, const Test& test) {
  std::multimap<double, const CircleObservation*, std::greater<>> by_size;
  for (const CircleObservation& circle : observations.circles) {
    if (circle.fit && circle.plane == observations.frame.plane && test(circle))
      by_size.emplace(ContourExtent(circle), &circle);
  }
  Circles circles;
  for (const auto& [extent, circle] : by_size) {
    if (circles.size() == most) break;
    circles.push_back(*circle);
  }
  return circles;
}

bool IsAny(const CircleObservation&) { return true; }

// Takes away what would place their centres.
void ForgetCenters(Circles* circles) {
  for (CircleObservation& circle : *circles) {
    circle.center.reset();
    circle.diameters.clear();
  }
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

// Keeps `circles`, camera, frame and known lengths of the world plane, and the lines that carry the
// drawn axes, which fix the rotation about the normal.
Status Keep(Circles circles, const Observations& observations, Observations* evidence) {
  *evidence = KeepFrame(observations, observations.frame);
  std::string& origin = evidence->frame.origin_is_center;
  evidence->circles = std::move(circles);
  if (FindCircle(*evidence, origin) < 0) origin.clear();
  KeepAxisLine(observations, observations.frame.x_axis, PencilDirection::kX, evidence);
  KeepAxisLine(observations, observations.frame.y_axis, PencilDirection::kY, evidence);
  return Status::Ok();
}

// The largest circle, its contour alone.
Status SelectContour(const Observations& observations, Observations* evidence) {
  Circles circles = WorldCircles(observations, 1, IsAny);
  if (circles.empty()) return Status::Refused("no circle of the world's plane could be fitted");
  ForgetCenters(&circles);
  return Keep(std::move(circles), observations, evidence);
}

// The same, without what is known of its frame.
Status SelectSingleCircle(const Observations& observations, Observations* evidence) {
  const Status status = SelectContour(observations, evidence);
  if (!status.ok()) return status;
  evidence->frame = FrameObservation();
  evidence->frame.plane = observations.frame.plane;
  evidence->known_lengths.clear();
  evidence->pencils.clear();
  return status;
}

// The largest circle whose centre is known as `has_center` says, in words `needs`.
template <typename HasCenter>
auto SelectCentered(const std::string& needs, const HasCenter& has_center) {
  return [needs, has_center](const Observations& observations, Observations* evidence) {
    Circles circles = WorldCircles(observations, 1, [&](const CircleObservation& circle) {
      return has_center(observations, circle);
    });
    if (circles.empty()) return Status::Refused("the world's plane does not hold " + needs);
    return Keep(std::move(circles), observations, evidence);
  };
}

bool IsOrigin(const CircleObservation& circle, const FrameObservation& frame) {
  return !frame.origin_is_center.empty() && frame.origin_is_center == circle.id;
}

bool HasCenter(const Observations& observations, const CircleObservation& circle) {
  return circle.center || (observations.frame.origin && IsOrigin(circle, observations.frame));
}

bool HasDiameters(const Observations&, const CircleObservation& circle) {
  return circle.diameters.size() >= 2;
}

Status SelectParallelCircles(const Observations& observations, Observations* evidence) {
  // More circles add little to the choice of the plane, and the joint refinement uses them all.
  constexpr std::size_t kMaxCircles = 12;
  Circles circles = WorldCircles(observations, kMaxCircles, IsAny);
  if (circles.size() < 2)
    return Status::Refused("the world's plane holds fewer than two fitted circles");
  ForgetCenters(&circles);
  for (CircleObservation& circle : circles) circle.concentric.clear();
  return Keep(std::move(circles), observations, evidence);
}

// Those about the centre that the largest circle has that shares its own.
Status SelectConcentricCircles(const Observations& observations, Observations* evidence) {
  std::map<std::string, int> sizes;
  const auto is_of_world = [&observations](const CircleObservation& c) {
    return c.fit && c.plane == observations.frame.plane && !c.concentric.empty();
  };
  for (const CircleObservation& circle : observations.circles) {
    if (is_of_world(circle)) ++sizes[circle.concentric];
  }
  const Circles largest = WorldCircles(observations, 1, [&](const CircleObservation& c) {
    return is_of_world(c) && sizes[c.concentric] > 1;
  });
  if (largest.empty())
    return Status::Refused("the world's plane holds no two fitted circles that are concentric");
  Circles circles = WorldCircles(
      observations, observations.circles.size(),
      [&](const CircleObservation& c) { return c.concentric == largest[0].concentric; });
  ForgetCenters(&circles);
  return Keep(std::move(circles), observations, evidence);
}

Status SelectCircleFrame(const Observations& observations, Observations* evidence) {
  const Status status = SelectContour(observations, evidence);
  if (!status.ok() || (observations.frame.x_axis && observations.frame.y_axis)) return status;
  evidence->pencils.clear();
  for (const PencilObservation& pencil : observations.pencils) {
    if (pencil.direction == PencilDirection::kX || pencil.direction == PencilDirection::kY)
      evidence->pencils.push_back(pencil);
  }
  return status;
}

// Inverse variance of the normal, rad^2, of the first of a circle's planes.
double NormalWeight(const ConicFit& fit) {
  constexpr double kRounding = 1e-18;
  std::array<CirclePlane, 2> planes;
  CirclePlanes(fit, &planes);
  return 1.0 / (planes[0].covariance.trace() + kRounding);
}

// All kept circles, the first one with its centre and radius, and the drawn axes.
Status GatherCircles(const Observations& evidence, double sigma_px, Inputs* inputs) {
  GatherFrame(evidence, sigma_px, inputs);
  GatherDrawnAxes(evidence, sigma_px, inputs);
  for (const CircleObservation& circle : evidence.circles) {
    inputs->circles.push_back({{ConicToVector(circle.fit->conic), circle.fit->Covariance()},
                               {Eigen::Vector2d::Zero(), Eigen::Matrix2d::Zero()},
                               evidence.circles.size() > 1 ? NormalWeight(*circle.fit) : 1.0,
                               circle.contrast,
                               circle.fit->irregularity});
  }
  const CircleObservation& first = evidence.circles.front();
  inputs->radius = first.radius;
  inputs->radius_sigma = first.radius_sigma;
  inputs->center = MeasuredCenter(evidence, first, sigma_px);
  inputs->origin_at_center = IsOrigin(first, evidence.frame);
  const int origin = FindCircle(evidence, evidence.frame.origin_is_center);
  const bool at_same_center =
      origin >= 0 && !first.concentric.empty() &&
      evidence.circles[static_cast<std::size_t>(origin)].concentric == first.concentric;
  inputs->origin_observed = inputs->origin_observed || inputs->origin_at_center || at_same_center ||
                            inputs->DrawnAxesCross();
  return Status::Ok();
}

Status GatherCenter(const Observations& evidence, double sigma_px, Inputs* inputs) {
  GatherCircles(evidence, sigma_px, inputs);
  if (inputs->center.present()) return Status::Ok();
  return Status::Refused("the centre of circle '" + evidence.circles.front().id +
                         "' lies where the camera model cannot undistort it");
}

Status GatherCrossing(const Observations& evidence, double sigma_px, Inputs* inputs) {
  GatherCircles(evidence, sigma_px, inputs);
  return GatherDiameters(evidence.camera, evidence.circles.front(), sigma_px, &inputs->center);
}

Status GatherCircleFrame(const Observations& evidence, double sigma_px, Inputs* inputs) {
  GatherCircles(evidence, sigma_px, inputs);
  GatherAxisLines(evidence, sigma_px, inputs);
  if (inputs->x_line.present() && inputs->y_line.present()) return Status::Ok();
  return Status::Refused(std::string("there is no image of the ") +
                         (inputs->x_line.present() ? "Y" : "X") +
                         " axis, nor of a line of the plane along it");
}

}  // namespace

Measured MeasuredCenter(const Observations& observations, const CircleObservation& circle,
                        double sigma_px) {
  const FrameObservation& frame = observations.frame;
  const std::optional<Eigen::Vector2d>& center =
      circle.center || !IsOrigin(circle, frame) ? circle.center : frame.origin;
  if (!center) return {};
  const double sigma = circle.sigma_px > 0.0 ? circle.sigma_px : sigma_px;
  return MeasuredPoint(observations.camera, *center, sigma);
}

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
  const std::string center = "a circle and the image of its centre",
                    diameters = "a circle and two or more chords through its centre";
  return {
      {"single_circle", "a circle", "nothing: a circle alone has two poses", SelectSingleCircle,
       GatherCircles, SingleCirclePoses},
      {"circle_center", center, "the image of the circle's centre",
       SelectCentered(center, HasCenter), GatherCenter, CircleCenterPoses},
      {"circle_diameters", diameters, "the crossing of the diameters",
       SelectCentered(diameters, HasDiameters), GatherCrossing, CircleCenterPoses},
      {"concentric_circles", "two or more concentric circles",
       "the plane and centre that the circles have in common", SelectConcentricCircles,
       GatherCircles, ConcentricCirclePoses},
      {"parallel_circles", "two or more circles of one plane",
       "the plane that the circles have in common", SelectParallelCircles, GatherCircles,
       ParallelCirclePoses},
      {"circle_frame", "a circle and the images of the X and Y axes of its plane",
       "the right angle between the axes", SelectCircleFrame, GatherCircleFrame, CircleFramePoses},
  };
}

}  // namespace circline
