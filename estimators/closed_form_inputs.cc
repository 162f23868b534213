#include "circline/estimators/closed_form_inputs.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace circline {
namespace {

RayPair Homogeneous(const CalibratedPoint& a, const CalibratedPoint& b) {
  return {a.Homogeneous(), b.Homogeneous()};
}

std::optional<RayPair> CalibrateSegment(const Camera& camera, const Segment& segment) {
  CalibratedPoint a, b;
  if (!PixelToCalibrated(camera, segment[0], &a) || !PixelToCalibrated(camera, segment[1], &b))
    return {};
  return Homogeneous(a, b);
}

Measured FromLine(const LineFit& fit) { return Measured(fit.line, fit.covariance); }

// The best-measured line along the given axis; it need not lie in the plane to have the axis'
// direction.
Measured BestLine(const Observations& observations, PencilDirection role) {
  const LineFit* best = nullptr;
  for (const PencilObservation& pencil : observations.pencils) {
    if (pencil.direction != role) continue;
    for (const LineObservation& line : pencil.lines) {
      if (line.fit &&
          (best == nullptr || line.fit->covariance.trace() < best->covariance.trace())) {
        best = &*line.fit;
      }
    }
  }
  return best == nullptr ? Measured() : FromLine(*best);
}

// The given angle between two pencils, radians, from 0 to pi.
std::optional<double> KnownAngleBetween(const std::string& a, const std::string& b,
                                        const Observations& observations) {
  for (const KnownAngle& known : observations.known_angles) {
    if (IsBetween(known, a, b)) return std::acos(std::cos(known.value));
  }
  return {};
}

using Directions = std::array<Eigen::Vector3d, 2>;

// Both vanishing points, turned in their plane to be `angle` apart, each by its variance.
Directions SplitByVariance(const VanishingPointFit& a, const VanishingPointFit& b, double angle) {
  const Eigen::Vector3d n = a.direction.cross(b.direction).normalized();
  const Eigen::Vector3d ta = n.cross(a.direction), tb = n.cross(b.direction);
  const double va = ta.dot(a.covariance * ta), vb = tb.dot(b.covariance * tb);
  double excess = std::atan2(a.direction.cross(b.direction).norm(), a.direction.dot(b.direction));
  // Directions have no sense: `angle` or its supplement, whichever is nearer.
  constexpr double kPi = 3.14159265358979323846;
  excess -= std::abs(excess - angle) < std::abs(excess - (kPi - angle)) ? angle : kPi - angle;
  const double ea = excess * va / (va + vb), eb = excess - ea;
  return {std::cos(ea) * a.direction + std::sin(ea) * ta,
          std::cos(eb) * b.direction - std::sin(eb) * tb};
}

// Cost of two directions: of all lines of both pencils, 1/2 chi^2.
double LineCost(const std::array<PencilObservation, 2>& pencils, const Directions& directions) {
  double cost = 0.0;
  for (std::size_t k = 0; k < 2; ++k) {
    for (const LineObservation& line : pencils[k].lines) {
      if (!line.fit) continue;
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
    if (line.fit) lines.push_back(*line.fit);
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

void GatherDirections(const Observations& evidence, bool axes_are_orthogonal, Inputs* inputs) {
  const std::array<PencilObservation, 2> pencils = {evidence.pencils[0], evidence.pencils[1]};
  for (std::size_t k = 0; k < 2; ++k) {
    inputs->directions[k] = Measured(pencils[k].fit->direction, pencils[k].fit->covariance);
    inputs->roles[k] = pencils[k].direction;
  }
  std::optional<double> angle = KnownAngleBetween(pencils[0].id, pencils[1].id, evidence);
  const PencilDirection free = PencilDirection::kFree;
  if (axes_are_orthogonal && inputs->roles[0] != free && inputs->roles[1] != free) {
    angle = 1.5707963267948966;
  }
  if (!angle) return;

  constexpr double kGate = 2.0;  // Of cost: two standard deviations.
  double best =
      LineCost(pencils, SplitByVariance(*pencils[0].fit, *pencils[1].fit, *angle)) - kGate;
  const double both = pencils[0].fit->covariance.trace() + pencils[1].fit->covariance.trace();
  constexpr double kFollows = 100.0;
  for (std::size_t k = 0; k < 2; ++k) {
    // One direction from its vanishing point, the other from a line and the angle: the error of the
    // latter's own is across both. It follows the former: its variance along that is made the far
    // larger one, so that nobody weighs the two against each other.
    const Eigen::Vector3d d = pencils[k].fit->direction;
    for (const LineFit& line : BestLines(pencils[1 - k])) {
      for (const Eigen::Vector3d& other : OnConeAndPlane(d, *angle, line.line)) {
        Directions directions;
        directions[k] = d;
        directions[1 - k] = other;
        const double cost = LineCost(pencils, directions);
        if (!(cost < best)) continue;
        best = cost;
        inputs->directions[k] = Measured(d, pencils[k].fit->covariance);
        const Eigen::Vector3d across = d.cross(other).normalized();
        inputs->directions[1 - k] =
            Measured(other, other.dot(line.covariance * other) * across * across.transpose() +
                                kFollows * both * d * d.transpose());
      }
    }
  }
}

Measured::Measured(const Eigen::VectorXd& mean, const Eigen::MatrixXd& covariance) : value(mean) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance);
  columns = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
}

std::vector<Measured*> Inputs::All() {
  std::vector<Measured*> all = {&conic,         &center,        &x_line, &y_line,
                                &directions[0], &directions[1], &origin};
  for (Measured& more : more_conics) all.push_back(&more);
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
  for (const KnownLength& known : observations.known_lengths) {
    if (!IsInWorldPlane(known, observations)) continue;
    inputs->length_points = CalibrateSegment(camera, known.points);
    inputs->length = inputs->length_points ? known.value : 0.0;
    break;
  }
}

void GatherCircle(const Observations& observations, const CircleObservation& circle,
                  double sigma_px, Inputs* inputs) {
  inputs->conic = Measured(ConicToVector(circle.fit->conic), circle.fit->Covariance());
  inputs->radius = circle.radius;
  const FrameObservation& frame = observations.frame;
  const bool is_origin = !frame.origin_is_center.empty() && frame.origin_is_center == circle.id;
  const double sigma = circle.sigma_px > 0.0 ? circle.sigma_px : sigma_px;
  if (circle.center) {
    inputs->center = MeasuredPoint(observations.camera, *circle.center, sigma);
  } else if (frame.origin && is_origin) {
    inputs->center = MeasuredPoint(observations.camera, *frame.origin, sigma);
  }
  inputs->origin_at_center = is_origin;
}
}  // namespace circline
