#include "circline/estimators/closed_form_inputs.h"

#include <Eigen/Dense>

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

}  // namespace

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

void GatherAxisLines(const Observations& observations, double sigma_px, Inputs* inputs) {
  const FrameObservation& frame = observations.frame;
  inputs->x_line = frame.x_axis ? AxisLine(observations, *frame.x_axis, sigma_px)
                                : BestLine(observations, PencilDirection::kX);
  inputs->y_line = frame.y_axis ? AxisLine(observations, *frame.y_axis, sigma_px)
                                : BestLine(observations, PencilDirection::kY);
}

void GatherFrame(const Observations& observations, double sigma_px, Inputs* inputs) {
  const FrameObservation& frame = observations.frame;
  const Camera& camera = observations.camera;
  if (frame.x_axis) inputs->x_sense = CalibrateSegment(camera, *frame.x_axis);
  if (frame.y_axis) inputs->y_sense = CalibrateSegment(camera, *frame.y_axis);
  if (frame.origin) inputs->origin = MeasuredPoint(camera, *frame.origin, sigma_px);
  for (const KnownLength& known : observations.known_lengths) {
    if (!known.plane.empty() && known.plane != frame.plane) continue;
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
