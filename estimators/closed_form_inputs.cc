#include "circline/estimators/closed_form_inputs.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "circline/estimators/basics.h"
#include "circline/estimators/pencil_lean.h"

namespace circline {
namespace {

std::optional<RayPair> CalibrateSegment(const Camera& camera, const Segment& segment) {
  CalibratedPoint a, b;
  if (!PixelToCalibrated(camera, segment[0], &a) || !PixelToCalibrated(camera, segment[1], &b))
    return {};
  return RayPair{a.Homogeneous(), b.Homogeneous()};
}

Measured FromLine(const LineFit& fit) { return Measured(fit.line, fit.covariance); }

// The best-measured line along the given axis; it need not lie in the plane to have the axis'
// direction.
Measured BestLine(const Observations& observations, PencilDirection role) {
  const LineFit* best = nullptr;
  for (const PencilObservation& pencil : observations.pencils) {
    if (pencil.direction != role) continue;
    for (const LineObservation& line : pencil.lines) {
      if (line.fit && line.is_parallel &&
          (best == nullptr || line.fit->covariance.trace() < best->covariance.trace())) {
        best = &*line.fit;
      }
    }
  }
  return best == nullptr ? Measured() : FromLine(*best);
}

using Directions = std::array<Eigen::Vector3d, 2>;

// Cost of two directions: of all lines of both pencils, 1/2 chi^2.
double LineCost(const std::array<PencilObservation, 2>& pencils, const Directions& directions) {
  double cost = 0.0;
  for (std::size_t k = 0; k < 2; ++k) {
    for (const LineObservation& line : pencils[k].lines) {
      if (!line.fit || !line.is_parallel) continue;
      const double r = VanishingPointResidual(*line.fit, directions[k]);
      cost += 0.5 * r * r;
    }
  }
  return cost;
}

// The best-measured lines of a pencil, three at most.
std::vector<LineFit> BestLines(const PencilObservation& pencil) {
  std::vector<LineFit> lines;
  for (const LineObservation& line : pencil.lines) {
    if (line.fit && line.is_parallel) lines.push_back(*line.fit);
  }
  std::sort(lines.begin(), lines.end(), [](const LineFit& a, const LineFit& b) {
    return a.covariance.trace() < b.covariance.trace();
  });
  constexpr std::size_t kMost = 3;
  if (lines.size() > kMost) lines.resize(kMost);
  return lines;
}

// The directions in a line's interpretation plane that make `angle` with `d`: a cone meets a plane.
std::vector<Eigen::Vector3d> OnConeAndPlane(const Eigen::Vector3d& d, double angle,
                                            const Eigen::Vector3d& line) {
  const Eigen::Vector3d p = d - line * line.dot(d);
  const double norm = p.norm();
  const double along = std::cos(angle) / norm;
  if (!(std::abs(along) < 1.0)) return {};
  const Eigen::Vector3d u = p / norm, q = std::sqrt(1.0 - along * along) * line.cross(u);
  return {along * u + q, along * u - q};
}

// Two directions that make a known angle: both from their vanishing points, or one of them,
// directions[on_line], from a line and the angle.
struct Reading {
  Directions directions;
  double cost = 0.0;      // Of all lines.
  double variance = 0.0;  // Of their rotation, the sum about three axes, rad^2.
  std::optional<LineFit> line;
  std::size_t on_line = 0;
};

// One direction from its vanishing point, the other where a line's plane meets the cone about it,
// if it does: of two such directions the one that the lines favour.
std::optional<Reading> ReadOnLine(const std::array<PencilObservation, 2>& pencils,
                                  std::size_t on_line, double angle, const LineFit& line) {
  const VanishingPointFit& fit = *pencils[1 - on_line].fit;
  const Eigen::Vector3d d = fit.direction;
  std::optional<Reading> reading;
  for (const Eigen::Vector3d& other : OnConeAndPlane(d, angle, line.line)) {
    Reading r;
    r.directions[1 - on_line] = d;
    r.directions[on_line] = other;
    r.cost = LineCost(pencils, r.directions);
    const Eigen::Vector3d across = d.cross(other).normalized(), along = across.cross(d);
    // `other` stays in the line's plane: it moves across where d moves along, or the line tilts.
    const double leverage = 1.0 / line.line.dot(across), follows = leverage * line.line.dot(d);
    const double of_d = along.dot(fit.covariance * along);
    r.variance = across.dot(fit.covariance * across) + (1.0 + follows * follows) * of_d +
                 leverage * leverage * other.dot(line.covariance * other);
    r.line = line;
    r.on_line = on_line;
    if (std::isfinite(r.variance) && (!reading || r.cost < reading->cost)) reading = r;
  }
  return reading;
}

// Both vanishing points, turned in their plane to be `angle` apart, each by its variance.
Reading ReadVanishingPoints(const std::array<PencilObservation, 2>& pencils, double angle) {
  const VanishingPointFit &a = *pencils[0].fit, &b = *pencils[1].fit;
  const Eigen::Vector3d n = a.direction.cross(b.direction).normalized();
  const Eigen::Vector3d ta = n.cross(a.direction), tb = n.cross(b.direction);
  const double va = ta.dot(a.covariance * ta), vb = tb.dot(b.covariance * tb);
  double excess = std::atan2(a.direction.cross(b.direction).norm(), a.direction.dot(b.direction));
  // Directions have no sense: `angle` or its supplement, whichever is nearer.
  excess -= std::abs(excess - angle) < std::abs(excess - (kPi - angle)) ? angle : kPi - angle;
  const double ea = excess * va / (va + vb), eb = excess - ea;
  Reading r;
  r.directions = {std::cos(ea) * a.direction + std::sin(ea) * ta,
                  std::cos(eb) * b.direction - std::sin(eb) * tb};
  r.cost = LineCost(pencils, r.directions);
  r.variance = n.dot((a.covariance + b.covariance) * n) + va * vb / (va + vb);
  return r;
}

std::vector<Reading> ReadDirections(const std::array<PencilObservation, 2>& pencils, double angle) {
  std::vector<Reading> readings = {ReadVanishingPoints(pencils, angle)};
  for (std::size_t k = 0; k < 2; ++k) {
    for (const LineFit& line : BestLines(pencils[k])) {
      const std::optional<Reading> reading = ReadOnLine(pencils, k, angle, line);
      if (reading) readings.push_back(*reading);
    }
  }
  return readings;
}

// The fitted line of an axis: the pencil's line that it is a part of, or its own two points.
Measured AxisLine(const Observations& observations, const Segment& axis, double sigma_px) {
  int pencil, line;
  if (FindAxisLine(observations, axis, &pencil, &line)) {
    const LineObservation& found = observations.pencils[static_cast<std::size_t>(pencil)]
                                       .lines[static_cast<std::size_t>(line)];
    if (found.fit) return FromLine(*found.fit);
  }
  std::vector<CalibratedPoint> points;
  LineFit fit;
  PixelsToCalibrated(observations.camera, {axis[0], axis[1]}, &points);
  return FitLine(points, sigma_px, &fit).ok() ? FromLine(fit) : Measured();
}

}  // namespace

bool IsBetween(const KnownAngle& known, const std::string& a, const std::string& b) {
  return (known.pencils[0] == a && known.pencils[1] == b) ||
         (known.pencils[0] == b && known.pencils[1] == a);
}

const KnownAngle* FindKnownAngle(const std::vector<KnownAngle>& known, const std::string& a,
                                 const std::string& b) {
  const auto found = std::find_if(known.begin(), known.end(),
                                  [&](const KnownAngle& k) { return IsBetween(k, a, b); });
  return found == known.end() ? nullptr : &*found;
}

void GatherDirections(const Observations& evidence, bool axes_are_orthogonal, Inputs* inputs) {
  const std::array<PencilObservation, 2> pencils = {evidence.pencils[0], evidence.pencils[1]};
  for (std::size_t k = 0; k < 2; ++k) {
    inputs->directions[k] = Measured(pencils[k].fit->direction, pencils[k].fit->covariance);
    inputs->lean_shapes[k] = LeanShape(pencils[k]);
    inputs->roles[k] = pencils[k].direction;
  }
  const KnownAngle* known = FindKnownAngle(evidence.known_angles, pencils[0].id, pencils[1].id);
  const bool is_right =
      axes_are_orthogonal && RunsAlongAxis(pencils[0]) && RunsAlongAxis(pencils[1]);
  if (!is_right && known == nullptr) return;

  inputs->angle = is_right ? kRightAngle : std::acos(std::cos(known->value));  // From 0 to pi.
  inputs->angle_sigma = is_right ? 0.0 : known->sigma;
  const std::vector<Reading> readings = ReadDirections(pencils, inputs->angle);
  double lowest = readings.front().cost;
  for (const Reading& r : readings) lowest = std::min(lowest, r.cost);
  // Among what the lines allow, by what is expected: the lowest cost alone would make whichever is
  // chosen better than its covariance.
  constexpr double kCostGate = 2.0;  // 1/2 chi^2: two standard deviations.
  const Reading* best = nullptr;
  for (const Reading& r : readings) {
    if (r.cost <= lowest + kCostGate && (best == nullptr || r.variance < best->variance)) best = &r;
  }
  if (best == nullptr || !best->line) return;
  const std::size_t k = best->on_line;
  inputs->directions[k] = Measured(best->directions[k], Eigen::MatrixXd::Zero(3, 3));
  inputs->lean_shapes[k] = Eigen::Matrix3d::Identity();
  inputs->rough = best->directions[k];
  inputs->line = FromLine(*best->line);
  inputs->on_line = k;
}

bool DirectionsOf(const Inputs& inputs, Directions* directions) {
  for (std::size_t k = 0; k < 2; ++k) (*directions)[k] = inputs.directions[k].value.normalized();
  if (!inputs.line.present()) return true;
  const std::vector<Eigen::Vector3d> both = OnConeAndPlane(
      (*directions)[1 - inputs.on_line], inputs.angle, inputs.line.value.normalized());
  if (both.empty()) return false;
  const Eigen::Vector3d& exact =
      both[both[1].dot(inputs.rough) > both[0].dot(inputs.rough) ? 1 : 0];
  const Eigen::Vector3d difference = inputs.directions[inputs.on_line].value - inputs.rough;
  (*directions)[inputs.on_line] = (exact + difference).normalized();
  return true;
}

Measured::Measured(const Eigen::VectorXd& mean, const Eigen::MatrixXd& covariance) : value(mean) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance);
  columns = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

std::vector<MovedInput> Inputs::Moved() {
  std::vector<MovedInput> all;
  const auto add = [&all](InputKind kind, Measured* m) {
    if (m->present()) all.push_back({kind, m->value.data(), m->columns});
  };
  const auto add_number = [&all](double* value, double sigma) {
    all.push_back({InputKind::kNumber, value, Eigen::MatrixXd::Constant(1, 1, sigma)});
  };
  for (MeasuredCircle& circle : circles) {
    all.push_back({InputKind::kConic, circle.conic.value.data(), circle.conic.columns,
                   circle.contrast, circle.irregularity});
    add(InputKind::kNumber, &circle.tilt);
  }
  add(InputKind::kPoint, &center);
  add(InputKind::kLine, &x_line);
  add(InputKind::kLine, &y_line);
  for (Measured& direction : directions) add(InputKind::kPoint, &direction);
  add(InputKind::kLine, &line);
  add(InputKind::kPoint, &origin);
  if (line.present()) add_number(&angle, angle_sigma);
  add_number(&radius, radius * radius_sigma);
  add_number(&length, length * length_sigma);
  for (auto* pair : {&x_sense, &y_sense, &length_points}) {
    if (!*pair) continue;
    for (Eigen::Vector3d& ray : **pair) all.push_back({InputKind::kPoint, ray.data(), {}});
  }
  all.push_back({InputKind::kPoint, rough.data(), {}});
  return all;
}

Measured MeasuredPoint(const Camera& camera, const Eigen::Vector2d& pixel, double sigma_px) {
  CalibratedPoint p;
  if (!PixelToCalibrated(camera, pixel, &p)) return {};
  Eigen::Matrix2d J;
  J << p.x_from_pixel[0], p.x_from_pixel[1], p.x_from_pixel[2], p.x_from_pixel[3];
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  covariance.topLeftCorner<2, 2>() = sigma_px * sigma_px * J * J.transpose();
  return Measured(p.Homogeneous(), covariance);
}

void GatherDrawnAxes(const Observations& observations, double sigma_px, Inputs* inputs) {
  const FrameObservation& frame = observations.frame;
  if (frame.x_axis) inputs->x_line = AxisLine(observations, *frame.x_axis, sigma_px);
  if (frame.y_axis) inputs->y_line = AxisLine(observations, *frame.y_axis, sigma_px);
}

void GatherAxisLines(const Observations& observations, double sigma_px, Inputs* inputs) {
  GatherDrawnAxes(observations, sigma_px, inputs);
  const FrameObservation& frame = observations.frame;
  if (!frame.x_axis) inputs->x_line = BestLine(observations, PencilDirection::kX);
  if (!frame.y_axis) inputs->y_line = BestLine(observations, PencilDirection::kY);
}

void GatherFrame(const Observations& observations, double sigma_px, Inputs* inputs) {
  const FrameObservation& frame = observations.frame;
  const Camera& camera = observations.camera;
  if (frame.x_axis) inputs->x_sense = CalibrateSegment(camera, *frame.x_axis);
  if (frame.y_axis) inputs->y_sense = CalibrateSegment(camera, *frame.y_axis);
  if (frame.origin) inputs->origin = MeasuredPoint(camera, *frame.origin, sigma_px);
  inputs->origin_observed = inputs->origin.present();
  for (const KnownLength& known : observations.known_lengths) {
    if (!IsInWorldPlane(known, observations)) continue;
    inputs->length_points = CalibrateSegment(camera, known.points);
    if (!inputs->length_points) continue;
    inputs->length = known.value;
    inputs->length_sigma = known.sigma;
    break;
  }
}

}  // namespace circline
