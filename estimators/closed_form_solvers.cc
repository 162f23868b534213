#include "circline/estimators/closed_form_solvers.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <utility>

#include "circline/estimators/closed_form_solver.h"

namespace circline {
namespace {

// --- Circles ---

// Largest extent of a contour, pixels: the larger the circle, the more it says.
double Extent(const CircleObservation& circle) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& p : circle.points) box.extend(p);
  return circle.points.empty() ? 0.0 : box.diagonal().norm();
}

using CircleTest = std::function<bool(const CircleObservation&)>;

// Fitted circles of the world plane that pass the test, the largest first.
std::vector<CircleObservation> WorldCircles(const Observations& observations,
                                            const CircleTest& test) {
  std::vector<CircleObservation> circles;
  for (const CircleObservation& circle : observations.circles) {
    if (circle.fit && circle.plane == observations.frame.plane && test(circle))
      circles.push_back(circle);
  }
  std::stable_sort(
      circles.begin(), circles.end(),
      [](const CircleObservation& a, const CircleObservation& b) { return Extent(a) > Extent(b); });
  return circles;
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
    if (known.plane.empty() || known.plane == evidence.frame.plane)
      evidence.known_lengths.push_back(known);
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
  std::vector<CircleObservation> circles =
      Bare(WorldCircles(observations, [](const auto&) { return true; }));
  if (circles.empty()) return Status::Refused("no circle of the world's plane could be fitted");
  circles.resize(1);
  *evidence = KeepCircles(observations, std::move(circles));
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

void GatherDrawnAxes(const Observations& evidence, double sigma_px, Inputs* inputs) {
  if (evidence.frame.x_axis) inputs->x_line = AxisLine(evidence, *evidence.frame.x_axis, sigma_px);
  if (evidence.frame.y_axis) inputs->y_line = AxisLine(evidence, *evidence.frame.y_axis, sigma_px);
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
    std::vector<CircleObservation> circles = WorldCircles(
        observations, [&](const auto& circle) { return has_center(observations, circle); });
    if (circles.empty()) return Status::Refused("the world's plane does not hold " + needs);
    circles.resize(1);
    *evidence = KeepCircles(observations, std::move(circles));
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

// Where chords through the centre meet: in calibrated coordinates just what a vanishing point is to
// a pencil's lines.
Status GatherDiameters(const Observations& evidence, double sigma_px, Inputs* inputs) {
  const CircleObservation& circle = evidence.circles.front();
  const double sigma = circle.sigma_px > 0.0 ? circle.sigma_px : sigma_px;
  std::vector<LineFit> chords;
  for (const Segment& diameter : circle.diameters) {
    std::vector<CalibratedPoint> points;
    LineFit fit;
    PixelsToCalibrated(evidence.camera, {diameter[0], diameter[1]}, &points);
    if (FitLine(points, sigma, &fit).ok()) chords.push_back(fit);
  }
  VanishingPointFit center;
  const Status status = FitVanishingPoint(chords, &center);
  if (!status.ok()) {
    return Status::Refused("the diameters of circle '" + circle.id +
                           "' do not cross in one point: " + status.message);
  }
  if (center.direction.z() < 0.0) center.direction = -center.direction;
  inputs->center = Measured(center.direction, center.covariance);
  return Status::Ok();
}

Recipe CircleDiametersRecipe() {
  return CenterRecipe(
      "circle_diameters", "a circle and two or more chords through its centre",
      "the crossing of the diameters",
      [](const Observations&, const CircleObservation& circle) {
        return circle.diameters.size() >= 2;
      },
      GatherDiameters);
}

// Sum of the normal's variances, rad^2, by statistical linearisation.
double NormalVariance(const Measured& conic) {
  std::array<CirclePose, 2> poses, plus, minus;
  if (CirclePoses(VectorToConic(conic.value), &poses) == 0) return 0.0;
  double variance = 0.0;
  for (Eigen::Index k = 0; k < conic.columns.cols(); ++k) {
    const int up = CirclePoses(VectorToConic(conic.value + conic.columns.col(k)), &plus);
    const int down = CirclePoses(VectorToConic(conic.value - conic.columns.col(k)), &minus);
    const auto nearest = [&poses](const std::array<CirclePose, 2>& p,
                                  int count) -> Eigen::Vector3d {
      if (count == 0) return poses[0].normal;
      return p[count == 2 && p[1].normal.dot(poses[0].normal) > p[0].normal.dot(poses[0].normal)
                   ? 1
                   : 0]
          .normal;
    };
    variance += 0.25 * (nearest(plus, up) - nearest(minus, down)).squaredNorm();
  }
  return variance;
}

Status GatherCircles(const Observations& evidence, double sigma_px, Inputs* inputs) {
  GatherFrame(evidence, sigma_px, inputs);
  GatherCircle(evidence, evidence.circles.front(), sigma_px, inputs);
  GatherDrawnAxes(evidence, sigma_px, inputs);
  for (std::size_t i = 1; i < evidence.circles.size(); ++i) {
    const ConicFit& fit = *evidence.circles[i].fit;
    inputs->more_conics.emplace_back(ConicToVector(fit.conic), fit.Covariance());
  }
  constexpr double kRounding = 1e-18;
  inputs->normal_weights = {1.0 / (NormalVariance(inputs->conic) + kRounding)};
  for (const Measured& conic : inputs->more_conics) {
    inputs->normal_weights.push_back(1.0 / (NormalVariance(conic) + kRounding));
  }
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
    std::vector<CircleObservation> circles =
        Bare(WorldCircles(observations, [](const auto&) { return true; }));
    if (circles.size() < 2) {
      return Status::Refused("the world's plane holds fewer than two fitted circles");
    }
    circles.resize(std::min(circles.size(), kMaxCircles));
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
    for (const CircleObservation& first :
         WorldCircles(observations, [](const auto& c) { return !c.concentric.empty(); })) {
      std::vector<CircleObservation> circles = Bare(WorldCircles(
          observations, [&](const auto& c) { return c.concentric == first.concentric; }));
      if (circles.size() < 2) continue;
      *evidence = KeepCircles(observations, std::move(circles));
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

// --- Lines ---

using PencilPair = std::array<PencilObservation, 2>;

bool HasRole(const PencilObservation& pencil) { return pencil.direction != PencilDirection::kFree; }

// Whether two pencils have different directions: they run along different axes, are known to make
// an angle, or are measured more than three standard deviations apart.
bool Differ(const PencilObservation& a, const PencilObservation& b,
            const std::vector<KnownAngle>& known_angles) {
  constexpr double kGate = 3.0, kRounding = 1e-9;
  if (!(a.fit->direction.cross(b.fit->direction).norm() > kRounding)) return false;
  if (HasRole(a) && HasRole(b)) return a.direction != b.direction;
  for (const KnownAngle& known : known_angles) {
    const bool between = (known.pencils[0] == a.id && known.pencils[1] == b.id) ||
                         (known.pencils[0] == b.id && known.pencils[1] == a.id);
    if (between && std::abs(std::sin(known.value)) > kGate * known.sigma) return true;
  }
  return DirectionSeparation(*a.fit, *b.fit) > kGate;
}

// The first two pencils of different directions. Those of two different axes are tried first, then
// those with one.
Status FirstPair(std::vector<PencilObservation> pencils,
                 const std::vector<KnownAngle>& known_angles, PencilPair* pair) {
  std::stable_sort(pencils.begin(), pencils.end(),
                   [](const PencilObservation& a, const PencilObservation& b) {
                     return HasRole(a) > HasRole(b);
                   });
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

// Two fitted pencils that fix the world frame: along its axes, or in its plane. Where only pencils
// that are tied to nothing can be had, they span a plane of their own, "pencils".
Status SelectPencils(const Observations& observations, PencilPair* pair, FrameObservation* frame) {
  std::vector<PencilObservation> of_world, fitted;
  for (const PencilObservation& pencil : observations.pencils) {
    if (!pencil.fit) continue;
    fitted.push_back(pencil);
    if (HasRole(pencil) || pencil.plane == observations.frame.plane) of_world.push_back(pencil);
  }
  *frame = observations.frame;
  frame->origin_is_center.clear();
  if (FirstPair(of_world, observations.known_angles, pair).ok()) return Status::Ok();
  const Status status = FirstPair(fitted, observations.known_angles, pair);
  if (!status.ok()) return status;
  *frame = FrameObservation();
  frame->plane = (*pair)[0].plane = (*pair)[1].plane = "pencils";
  (*pair)[0].direction = PencilDirection::kX;
  (*pair)[1].direction = PencilDirection::kFree;
  return Status::Ok();
}

Status GatherPencils(const Observations& evidence, bool axes_are_orthogonal, double sigma_px,
                     Inputs* inputs) {
  GatherFrame(evidence, sigma_px, inputs);
  GatherDirections(evidence, axes_are_orthogonal, inputs);
  if (evidence.frame.x_axis) inputs->x_line = AxisLine(evidence, *evidence.frame.x_axis, sigma_px);
  if (evidence.frame.y_axis) inputs->y_line = AxisLine(evidence, *evidence.frame.y_axis, sigma_px);
  if (inputs->origin.present()) return Status::Ok();
  // The origin: where the axes cross, or by convention where the first lines of the pencils do.
  const auto line = [&](const Measured& axis, std::size_t i) -> Eigen::Vector3d {
    if (axis.present()) return axis.value;
    for (const LineObservation& l : evidence.pencils[i].lines) {
      if (l.fit) return l.fit->line;
    }
    return Eigen::Vector3d::Zero();
  };
  const bool y_first =
      inputs->roles[0] == PencilDirection::kY || inputs->roles[1] == PencilDirection::kX;
  const std::size_t x = y_first ? 1 : 0;
  Eigen::Vector3d crossing = line(inputs->x_line, x).cross(line(inputs->y_line, 1 - x));
  if (!(std::abs(crossing.z()) > 1e-9 * crossing.norm())) crossing = Eigen::Vector3d::UnitZ();
  inputs->origin.value = crossing / crossing.z();
  inputs->origin.columns = Eigen::MatrixXd::Zero(3, 0);
  return Status::Ok();
}

Observations KeepPencils(const Observations& observations, const PencilPair& pair,
                         const FrameObservation& frame) {
  Observations evidence;
  evidence.camera = observations.camera;
  evidence.frame = frame;
  evidence.pencils = {pair[0], pair[1]};
  evidence.known_lengths = observations.known_lengths;
  evidence.known_angles = observations.known_angles;
  return evidence;
}

Recipe LinePairsRecipe() {
  Recipe r;
  r.name = "line_pairs";
  r.needs = "two pencils of parallel lines, two or more lines each";
  r.select = [](const Observations& observations, Observations* evidence) {
    PencilPair pair;
    FrameObservation frame;
    const Status status = SelectPencils(observations, &pair, &frame);
    if (status.ok()) *evidence = KeepPencils(observations, pair, frame);
    return status;
  };
  // Proposition 5 makes no use of what the axes are.
  r.gather = [](const Observations& evidence, double sigma_px, Inputs* inputs) {
    return GatherPencils(evidence, false, sigma_px, inputs);
  };
  r.evaluate = LinePairPoses;
  return r;
}

Recipe OrthogonalVanishingPointsRecipe() {
  Recipe r;
  r.name = "orthogonal_vanishing_points";
  r.needs = "two pencils of parallel lines along two of the axes";
  r.select = [](const Observations& observations, Observations* evidence) {
    std::vector<PencilObservation> along_axes;
    for (const PencilObservation& pencil : observations.pencils) {
      if (pencil.fit && HasRole(pencil)) along_axes.push_back(pencil);
    }
    PencilPair pair;
    const Status status = FirstPair(along_axes, observations.known_angles, &pair);
    if (!status.ok()) return Status::Refused("of the pencils along an axis: " + status.message);
    FrameObservation frame = observations.frame;
    frame.origin_is_center.clear();
    *evidence = KeepPencils(observations, pair, frame);
    return Status::Ok();
  };
  r.gather = [](const Observations& evidence, double sigma_px, Inputs* inputs) {
    return GatherPencils(evidence, true, sigma_px, inputs);
  };
  r.evaluate = OrthogonalDirectionPoses;
  return r;
}

}  // namespace

Status ClosedFormOptions::Validate() const {
  return sigma_px > 0.0 && std::isfinite(sigma_px) ? Status::Ok()
                                                   : Status::Invalid("sigma_px must be positive");
}

bool WorldRotation(const Observations& observations, const Eigen::Vector3d& normal,
                   const Eigen::Vector3d& plane_ray, double sigma_px, Eigen::Matrix3d* rotation) {
  Inputs inputs;
  GatherFrame(observations, sigma_px, &inputs);
  GatherAxisLines(observations, sigma_px, &inputs);
  return RotationOfPlane(normal, plane_ray, inputs, rotation);
}

void AddClosedFormSolvers(SolverRegistry* registry, const ClosedFormOptions& options) {
  for (const Recipe& recipe :
       {OrthogonalVanishingPointsRecipe(), LinePairsRecipe(), SingleCircleRecipe(),
        CircleCenterRecipe(), CircleDiametersRecipe(), ConcentricCirclesRecipe(),
        ParallelCirclesRecipe(), CircleFrameRecipe()}) {
    registry->Add(std::make_shared<ClosedFormSolver>(recipe, options));
  }
}

}  // namespace circline
