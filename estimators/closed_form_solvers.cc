#include "circline/estimators/closed_form_solvers.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "circline/estimators/circle_pose.h"
#include "circline/estimators/line_pose.h"

namespace circline {
namespace {

// A measured vector and a square root of its covariance: `columns` perturb the value by one
// standard deviation along independent directions.
struct Measured {
  Eigen::VectorXd value;
  Eigen::MatrixXd columns;

  Measured() = default;
  Measured(const Eigen::VectorXd& mean, const Eigen::MatrixXd& covariance) : value(mean) {
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance);
    columns = eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt().asDiagonal();
  }
  bool present() const { return value.size() > 0; }
};

// What the propositions work on, all calibrated.
struct Inputs {
  Measured conic;                      // ConicToVector, 6.
  Measured center;                     // Image of the circle's centre, homogeneous, 3.
  Measured x_line, y_line;             // Images of the axes or of lines parallel to them, 3.
  std::array<Measured, 2> directions;  // Vanishing points of two pencils, 3.
  Measured origin;                     // Image of the world origin, homogeneous, 3.
  std::array<PencilDirection, 2> roles{PencilDirection::kFree, PencilDirection::kFree};
  std::optional<std::array<Eigen::Vector3d, 2>> x_sense, y_sense;  // Oriented axes, homogeneous.
  bool origin_at_center =
      false;            // The axes cross at the circle's centre: evidence for circle_frame.
  double radius = 0.0;  // Metric scale from the circle, or 0.
  std::optional<std::array<Eigen::Vector3d, 2>> length_points;  // Metric scale from two points ...
  double length = 0.0;                                          // ... of the plane, or 0.

  // Every perturbable input.
  std::array<Measured*, 7> All() {
    return {&conic, &center, &x_line, &y_line, &directions[0], &directions[1], &origin};
  }
};

// A pose and how far it contradicts the evidence that it was not computed from.
struct Candidate {
  CameraPose pose;
  Eigen::VectorXd contradiction;
  std::optional<CirclePose> circle;
};

using Evaluate = std::function<std::vector<Candidate>(const Inputs&)>;

// --- Gathering evidence
// ---------------------------------------------------------------------------

std::array<Eigen::Vector3d, 2> Homogeneous(const CalibratedPoint& a, const CalibratedPoint& b) {
  return {a.Homogeneous(), b.Homogeneous()};
}

std::optional<std::array<Eigen::Vector3d, 2>> CalibrateSegment(const Camera& camera,
                                                               const Segment& segment) {
  CalibratedPoint a, b;
  if (!PixelToCalibrated(camera, segment[0], &a) || !PixelToCalibrated(camera, segment[1], &b))
    return {};
  return Homogeneous(a, b);
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

Measured FromLine(const LineFit& fit) { return Measured(fit.line, fit.covariance); }

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

// Images of the axes, or else of lines along them.
void GatherAxisLines(const Observations& observations, double sigma_px, Inputs* inputs) {
  const FrameObservation& frame = observations.frame;
  inputs->x_line = frame.x_axis ? AxisLine(observations, *frame.x_axis, sigma_px)
                                : BestLine(observations, PencilDirection::kX);
  inputs->y_line = frame.y_axis ? AxisLine(observations, *frame.y_axis, sigma_px)
                                : BestLine(observations, PencilDirection::kY);
}

// The circle of the world plane with the most to say: the one with a known centre if `with_center`,
// and of those the one that covers most pixels. Null if there is none.
const CircleObservation* BestCircle(const Observations& observations, bool with_center) {
  const CircleObservation* best = nullptr;
  double best_size = 0.0;
  for (const CircleObservation& circle : observations.circles) {
    if (!circle.fit || circle.plane != observations.frame.plane) continue;
    const bool has_center = circle.center || (observations.frame.origin &&
                                              observations.frame.origin_is_center == circle.id);
    if (with_center && !has_center) continue;
    Eigen::AlignedBox2d box;
    for (const Eigen::Vector2d& p : circle.points) box.extend(p);
    const double size = circle.points.empty() ? 0.0 : box.diagonal().norm();
    if (best == nullptr || size > best_size) {
      best = &circle;
      best_size = size;
    }
  }
  return best;
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
  const double sigma = circle.sigma_px > 0.0 ? circle.sigma_px : sigma_px;
  if (circle.center) {
    inputs->center = MeasuredPoint(observations.camera, *circle.center, sigma);
  } else if (frame.origin && frame.origin_is_center == circle.id) {
    inputs->center = MeasuredPoint(observations.camera, *frame.origin, sigma);
  }
  inputs->origin_at_center = frame.origin_is_center == circle.id;
}

// --- Shared pieces of the propositions
// --------------------------------------------------------------

// Picks the senses of the axes: as drawn, then +Z towards the camera, then X to the right (or
// down).
Eigen::Matrix3d Orient(const Eigen::Matrix3d& rotation, const Eigen::Vector3d& plane_ray,
                       const Inputs& inputs) {
  Eigen::Matrix3d best = rotation;
  int best_score = -1;
  const Eigen::Vector3d normal = rotation.col(2);
  for (const Eigen::Matrix3d& R : SignChoices(rotation)) {
    int score = 0;
    if (inputs.x_sense && MovesAlong(R.col(0), normal, (*inputs.x_sense)[0], (*inputs.x_sense)[1]))
      score += 8;
    if (inputs.y_sense && MovesAlong(R.col(1), normal, (*inputs.y_sense)[0], (*inputs.y_sense)[1]))
      score += 4;
    if (R.col(2).dot(plane_ray) < 0.0) score += 2;
    const bool horizontal = std::abs(R(0, 0)) > 1e-9;
    if (horizontal ? R(0, 0) > 0.0 : R(1, 0) > 0.0) score += 1;
    if (score > best_score) {
      best_score = score;
      best = R;
    }
  }
  return best;
}

// Variance of the in-plane angle of the direction n x l, from the covariance of l.
double InPlaneVariance(const Measured& line, const Eigen::Vector3d& direction) {
  return (direction.normalized().transpose() * line.columns).squaredNorm();
}

// Rotation of a plane with unit normal n, in-plane angle from the axis lines (proposition 2; both:
// proposition 4), or by convention: X towards the camera's right.
bool RotationOfPlane(const Eigen::Vector3d& n, const Eigen::Vector3d& plane_ray,
                     const Inputs& inputs, Eigen::Matrix3d* rotation) {
  const auto direction = [&n](const Measured& line) -> Eigen::Vector3d {
    return n.cross(Eigen::Vector3d(line.value));
  };
  bool valid = true;
  if (inputs.x_line.present() && inputs.y_line.present()) {
    const Eigen::Vector3d x = direction(inputs.x_line), y = direction(inputs.y_line);
    valid = RotationFromOrthogonalDirections(x, InPlaneVariance(inputs.x_line, x) / x.squaredNorm(),
                                             y, InPlaneVariance(inputs.y_line, y) / y.squaredNorm(),
                                             rotation);
  } else if (inputs.x_line.present()) {
    const Eigen::Vector3d x = direction(inputs.x_line);
    valid = RotationFromDirections(x, n.cross(x), rotation);
  } else if (inputs.y_line.present()) {
    const Eigen::Vector3d y = direction(inputs.y_line);
    valid = RotationFromDirections(y.cross(n), y, rotation);
  } else {
    const Eigen::Vector3d reference =
        std::abs(n.x()) < 0.9 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
    const Eigen::Vector3d x = reference - n.dot(reference) * n;
    valid = RotationFromDirections(x, n.cross(x), rotation);
  }
  if (!valid) return false;
  *rotation = Orient(*rotation, plane_ray, inputs);
  return rotation->allFinite();
}

// Translation: the point where the origin's ray meets the plane n . X = distance. `distance` 0
// means unknown; then a known length gives it, or the translation is a direction.
Eigen::Vector3d Translation(const Eigen::Vector3d& n, double distance,
                            const Eigen::Vector3d& origin_ray, const Inputs& inputs) {
  const double along = n.dot(origin_ray);
  Eigen::Vector3d t = origin_ray / (along != 0.0 ? along : 1.0);  // On the plane n . X = 1.
  if (t.z() < 0.0) t = -t;
  if (inputs.radius > 0.0 && distance != 0.0) return std::abs(distance) * inputs.radius * t;
  if (inputs.length > 0.0) {
    const Eigen::Vector3d a = (*inputs.length_points)[0], b = (*inputs.length_points)[1];
    const double units = (a / n.dot(a) - b / n.dot(b)).norm();
    if (units > 0.0) return inputs.length / units * t;
  }
  return t.normalized();
}

bool IsMetric(const Inputs& inputs) {
  return (inputs.conic.present() && inputs.radius > 0.0) || inputs.length > 0.0;
}

// Image of the origin as seen by a circle's hypothesis: the measured origin, the crossing of the
// axes, or the circle's centre.
Eigen::Vector3d OriginRay(const Inputs& inputs, const CirclePose& circle) {
  if (inputs.origin.present() && !inputs.origin_at_center) return inputs.origin.value;
  if (!inputs.origin_at_center && inputs.x_sense && inputs.y_sense && inputs.x_line.present() &&
      inputs.y_line.present()) {
    return Eigen::Vector3d(inputs.x_line.value).cross(Eigen::Vector3d(inputs.y_line.value));
  }
  return circle.center;
}

// --- The propositions
// -----------------------------------------------------------------------------

// One candidate per circle plane; `contradict` says how far other evidence speaks against it.
std::vector<Candidate> CircleCandidates(
    const Inputs& inputs,
    const std::function<Eigen::VectorXd(const CirclePose&, const Inputs&)>& contradict) {
  std::vector<Candidate> candidates;
  std::array<CirclePose, 2> poses;
  const int count = CirclePoses(VectorToConic(inputs.conic.value), &poses);
  for (int i = 0; i < count; ++i) {
    const CirclePose& circle = poses[static_cast<std::size_t>(i)];
    Candidate c;
    if (!RotationOfPlane(circle.normal, circle.center, inputs, &c.pose.rotation)) continue;
    c.pose.translation = Translation(circle.normal, circle.normal.dot(circle.center),
                                     OriginRay(inputs, circle), inputs);
    c.contradiction = contradict(circle, inputs);
    c.circle = circle;
    candidates.push_back(c);
  }
  return candidates;
}

Eigen::Vector2d CenterMiss(const CirclePose& circle, const Eigen::VectorXd& measured) {
  return (circle.center / circle.center.z()).head<2>() - measured.head<2>() / measured[2];
}

std::vector<Candidate> EvaluateCircleCenter(const Inputs& inputs) {
  return CircleCandidates(inputs,
                          [](const CirclePose& circle, const Inputs& in) -> Eigen::VectorXd {
                            return CenterMiss(circle, in.center.value);
                          });
}

std::vector<Candidate> EvaluateCircleFrame(const Inputs& inputs) {
  return CircleCandidates(inputs,
                          [](const CirclePose& circle, const Inputs& in) -> Eigen::VectorXd {
                            const Eigen::Vector3d lx = in.x_line.value, ly = in.y_line.value;
                            const Eigen::Vector3d x = circle.normal.cross(lx).normalized(),
                                                  y = circle.normal.cross(ly).normalized();
                            Eigen::VectorXd contradiction(in.origin_at_center ? 3 : 1);
                            contradiction[0] = x.dot(y);
                            if (in.origin_at_center)
                              contradiction.tail<2>() = CenterMiss(circle, lx.cross(ly));
                            return contradiction;
                          });
}

// Proposition 1, where the roles say that the directions are orthogonal: the excess over 90 degrees
// is split by variance.
bool RotationOfAxes(const Inputs& inputs, Eigen::Matrix3d* rotation) {
  const Eigen::Vector3d a = inputs.directions[0].value, b = inputs.directions[1].value;
  const Eigen::Vector3d normal = a.cross(b).normalized();
  const auto variance = [&normal](const Measured& m) {
    const Eigen::Vector3d tangent = normal.cross(Eigen::Vector3d(m.value));
    return (tangent.transpose() * m.columns).squaredNorm();
  };
  Eigen::Matrix3d R;
  if (!RotationFromOrthogonalDirections(a, variance(inputs.directions[0]), b,
                                        variance(inputs.directions[1]), &R)) {
    return false;
  }
  // R has the two directions as its first columns; move them to the columns of their axes.
  const int i = static_cast<int>(inputs.roles[0]), j = static_cast<int>(inputs.roles[1]);
  rotation->col(i) = R.col(0);
  rotation->col(j) = R.col(1);
  rotation->col(3 - i - j) = R.col(2) * ((i + 1) % 3 == j ? 1.0 : -1.0);
  return true;
}

// Proposition 5, and 1 where both roles are known. The first direction is the one with a role.
bool RotationOfPair(const Inputs& inputs, const Eigen::Vector3d& plane_ray,
                    Eigen::Matrix3d* rotation) {
  const auto [first, second] = inputs.roles;
  if (first != PencilDirection::kFree && second != PencilDirection::kFree)
    return RotationOfAxes(inputs, rotation);
  const Eigen::Vector3d a = inputs.directions[0].value, b = inputs.directions[1].value;
  Eigen::Matrix3d R;
  if (!RotationFromDirections(a, b, &R)) return false;
  *rotation = R;
  if (first == PencilDirection::kY) {
    rotation->col(0) = -R.col(1);
    rotation->col(1) = R.col(0);
  } else if (first == PencilDirection::kFree) {
    return RotationOfPlane(R.col(2), plane_ray, inputs, rotation);
  }
  return true;
}

std::vector<Candidate> EvaluateLinePairs(const Inputs& inputs) {
  Candidate c;
  const Eigen::Vector3d ray = inputs.origin.value;
  Eigen::Matrix3d R;
  if (!RotationOfPair(inputs, ray, &R)) return {};
  c.pose.rotation = Orient(R, ray, inputs);
  c.pose.translation = Translation(c.pose.rotation.col(2), 0.0, ray, inputs);
  if (!c.pose.rotation.allFinite() || !c.pose.translation.allFinite()) return {};
  return {c};
}

// --- Uncertainty
// ------------------------------------------------------------------------------------

const Candidate* Nearest(const std::vector<Candidate>& candidates, const Candidate& reference) {
  const Candidate* best = nullptr;
  double best_angle = std::numeric_limits<double>::infinity();
  for (const Candidate& c : candidates) {
    const double angle = RotationAngle(c.pose.rotation, reference.pose.rotation);
    if (angle < best_angle) {
      best_angle = angle;
      best = &c;
    }
  }
  return best;
}

// Statistical linearisation: every independent error of the inputs, one standard deviation up and
// down, through the closed form itself. Returns columns of [delta, delta_t, contradiction].
Eigen::MatrixXd Sensitivity(const Evaluate& evaluate, const Inputs& inputs,
                            const Candidate& candidate) {
  const Eigen::Index rows = 6 + candidate.contradiction.size();
  std::vector<Eigen::VectorXd> columns;
  Inputs perturbed = inputs;
  for (Measured* m : perturbed.All()) {
    const Eigen::VectorXd value = m->value;
    for (Eigen::Index k = 0; k < m->columns.cols(); ++k) {
      if (m->columns.col(k).isZero(0.0)) continue;
      m->value = value + m->columns.col(k);
      const std::vector<Candidate> plus_all = evaluate(perturbed);
      m->value = value - m->columns.col(k);
      const std::vector<Candidate> minus_all = evaluate(perturbed);
      m->value = value;
      const Candidate* plus = Nearest(plus_all, candidate);
      const Candidate* minus = Nearest(minus_all, candidate);
      if (plus == nullptr || minus == nullptr) continue;
      Eigen::VectorXd column(rows);
      column.head<3>() = 0.5 * LogRotation(plus->pose.rotation * minus->pose.rotation.transpose());
      column.segment<3>(3) = 0.5 * (plus->pose.translation - minus->pose.translation);
      column.tail(rows - 6) = 0.5 * (plus->contradiction - minus->contradiction);
      columns.push_back(column);
    }
  }
  Eigen::MatrixXd out(rows, static_cast<Eigen::Index>(columns.size()));
  for (std::size_t k = 0; k < columns.size(); ++k)
    out.col(static_cast<Eigen::Index>(k)) = columns[k];
  return out;
}

void FillUncertainty(const Evaluate& evaluate, const Inputs& inputs, const Candidate& candidate,
                     bool rotation_is_free, PoseHypothesis* h) {
  const Eigen::MatrixXd S = Sensitivity(evaluate, inputs, candidate);
  Matrix6d covariance = S.topRows<6>() * S.topRows<6>().transpose();
  if (rotation_is_free) {
    Vector6d free = Vector6d::Zero();
    free.head<3>() = candidate.pose.rotation.col(2);
    const Matrix6d project = Matrix6d::Identity() - free * free.transpose();
    covariance = project * covariance * project;
    std::array<double, 6> direction;
    Eigen::Map<Vector6d>(direction.data()) = free;
    h->free_directions.push_back(direction);
  }
  Eigen::Map<Matrix6d>(h->covariance.data()) = covariance;
  h->rank = static_cast<int>(Eigen::FullPivLU<Matrix6d>(covariance).setThreshold(1e-9).rank());
  if (candidate.contradiction.size() > 0) {
    const Eigen::MatrixXd tail = S.bottomRows(candidate.contradiction.size());
    const Eigen::MatrixXd C = tail * tail.transpose();
    h->cost = 0.5 * candidate.contradiction.dot(
                        C.completeOrthogonalDecomposition().solve(candidate.contradiction));
    if (!std::isfinite(h->cost)) h->cost = 0.5 * std::numeric_limits<double>::max();
  }
}

// --- Solvers
// ----------------------------------------------------------------------------------------

// Counts and rms of the fits that a hypothesis rests on.
void FillSupport(const Observations& evidence, PoseHypothesis* h) {
  double squares = 0.0;
  const auto add = [&](double rms, const std::vector<Eigen::Vector2d>& points,
                       const std::vector<std::uint8_t>& mask) {
    const int inliers = mask.empty() ? static_cast<int>(points.size())
                                     : static_cast<int>(std::count(mask.begin(), mask.end(), 1));
    squares += rms * rms * inliers;
    h->num_inliers += inliers;
    h->num_observations += static_cast<int>(points.size());
  };
  for (const CircleObservation& c : evidence.circles) {
    if (c.fit) add(c.fit->rms_px, c.points, c.inliers);
  }
  for (const PencilObservation& pencil : evidence.pencils) {
    for (const LineObservation& line : pencil.lines) {
      if (line.fit) add(line.fit->rms_px, line.points, line.inliers);
    }
    if (!pencil.fit) continue;
    PencilEstimate estimate;
    estimate.id = pencil.id;
    estimate.direction = pencil.fit->direction;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(pencil.fit->covariance,
                                                               Eigen::EigenvaluesOnly);
    estimate.sigma_deg = std::sqrt(std::max(0.0, eigen.eigenvalues()[2])) * 57.29577951308232;
    h->pencils.push_back(estimate);
  }
  if (h->num_inliers > 0) h->rms_px = std::sqrt(squares / h->num_inliers);
}

void FillCircle(const Observations& evidence, const CirclePose& pose, PoseHypothesis* h) {
  const CircleObservation& circle = evidence.circles.front();
  // CirclePose counts in radii; the hypothesis' unit is metric, or makes the translation a unit
  // vector.
  const Eigen::Vector3d n = h->cam_from_world.rotation.col(2);
  const double distance = std::abs(n.dot(h->cam_from_world.translation));
  const double unit = distance / std::abs(pose.normal.dot(pose.center));
  CircleEstimate estimate;
  estimate.id = circle.id;
  estimate.normal = pose.normal;
  estimate.center = unit * pose.center;
  estimate.radius = unit;
  CameraToPixel(evidence.camera, pose.center, &estimate.center_px);
  h->circles.push_back(estimate);
}

// What one closed form consists of.
struct Recipe {
  std::string name, needs;
  // Keeps of the (fitted) observations what is used; a refusal says what was missing.
  std::function<Status(const Observations&, Observations*)> select;
  // Reads the kept evidence.
  std::function<Status(const Observations&, double sigma_px, Inputs*)> gather;
  Evaluate evaluate;
  std::string decided_by;
};

class ClosedFormSolver : public Solver {
 public:
  ClosedFormSolver(Recipe recipe, const ClosedFormOptions& options)
      : recipe_(std::move(recipe)), options_(options) {}

  const std::string& name() const override { return recipe_.name; }
  SolverStage stage() const override { return SolverStage::kClosedForm; }
  std::string needs() const override { return recipe_.needs; }

  Observations Evidence(const Observations& observations) const override {
    Observations evidence;
    recipe_.select(Resolved(observations), &evidence);
    return evidence;
  }

  PoseEstimate Solve(const Observations& observations) const override {
    PoseEstimate estimate;
    estimate.solver = recipe_.name;
    estimate.status = options_.Validate();
    if (estimate.status.ok()) estimate.status = observations.Validate();
    Observations evidence;
    if (estimate.status.ok()) estimate.status = recipe_.select(Resolved(observations), &evidence);
    Inputs inputs;
    if (estimate.status.ok())
      estimate.status = recipe_.gather(evidence, options_.sigma_px, &inputs);
    if (!estimate.status.ok()) return estimate;

    const std::vector<Candidate> candidates = recipe_.evaluate(inputs);
    const bool free =
        !inputs.x_line.present() && !inputs.y_line.present() && !inputs.directions[0].present();
    for (const Candidate& candidate : candidates) {
      PoseHypothesis h;
      h.cam_from_world = candidate.pose;
      h.metric = IsMetric(inputs);
      const FrameObservation& frame = evidence.frame;
      h.origin_observed =
          frame.origin || !frame.origin_is_center.empty() || (frame.x_axis && frame.y_axis);
      FillSupport(evidence, &h);
      if (candidate.circle) FillCircle(evidence, *candidate.circle, &h);
      FillUncertainty(recipe_.evaluate, inputs, candidate, free, &h);
      estimate.hypotheses.push_back(std::move(h));
    }
    if (estimate.hypotheses.empty()) {
      estimate.status = Status::Refused(recipe_.name + ": the evidence is degenerate (" +
                                        recipe_.needs + " are needed)");
    }
    RankHypotheses(&estimate.hypotheses);
    estimate.decided_by =
        estimate.hypotheses.size() > 1 ? recipe_.decided_by : "only one pose fits";
    return estimate;
  }

 private:
  Observations Resolved(const Observations& observations) const {
    Observations fitted = observations;
    FitDirect(options_.sigma_px, &fitted);
    return ResolveWorld(fitted);
  }

  Recipe recipe_;
  ClosedFormOptions options_;
};

Status SelectCircle(const Observations& observations, bool with_center, Observations* evidence) {
  const CircleObservation* circle = BestCircle(observations, with_center);
  if (circle == nullptr) {
    return Status::Refused(with_center ? "no circle of the world's plane has a known centre"
                                       : "no circle of the world's plane could be fitted");
  }
  evidence->camera = observations.camera;
  evidence->circles = {*circle};
  evidence->frame = observations.frame;
  if (evidence->frame.origin_is_center != circle->id) evidence->frame.origin_is_center.clear();
  for (const KnownLength& known : observations.known_lengths) {
    if (known.plane.empty() || known.plane == evidence->frame.plane)
      evidence->known_lengths.push_back(known);
  }
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

Recipe CircleCenterRecipe() {
  Recipe r;
  r.name = "circle_center";
  r.needs = "a circle and the image of its centre";
  r.decided_by = "the image of the circle's centre";
  r.select = [](const Observations& observations, Observations* evidence) {
    const Status status = SelectCircle(observations, true, evidence);
    if (!status.ok()) return status;
    KeepAxisLine(observations, observations.frame.x_axis, PencilDirection::kX, evidence);
    KeepAxisLine(observations, observations.frame.y_axis, PencilDirection::kY, evidence);
    return Status::Ok();
  };
  r.gather = [](const Observations& evidence, double sigma_px, Inputs* inputs) {
    GatherFrame(evidence, sigma_px, inputs);
    GatherCircle(evidence, evidence.circles.front(), sigma_px, inputs);
    if (evidence.frame.x_axis)
      inputs->x_line = AxisLine(evidence, *evidence.frame.x_axis, sigma_px);
    if (evidence.frame.y_axis)
      inputs->y_line = AxisLine(evidence, *evidence.frame.y_axis, sigma_px);
    return inputs->center.present()
               ? Status::Ok()
               : Status::Refused("the centre of circle '" + evidence.circles.front().id +
                                 "' lies where the camera model cannot undistort it");
  };
  r.evaluate = EvaluateCircleCenter;
  return r;
}

Recipe SingleCircleRecipe() {
  Recipe r;
  r.name = "single_circle";
  r.needs = "a circle";
  r.decided_by = "nothing: a circle alone has two poses";
  r.select = [](const Observations& observations, Observations* evidence) {
    const Status status = SelectCircle(observations, false, evidence);
    if (!status.ok()) return status;
    evidence->circles.front().center.reset();
    evidence->circles.front().diameters.clear();
    evidence->frame = FrameObservation();
    evidence->frame.plane = observations.frame.plane;
    evidence->known_lengths.clear();
    return Status::Ok();
  };
  r.gather = [](const Observations& evidence, double sigma_px, Inputs* inputs) {
    GatherCircle(evidence, evidence.circles.front(), sigma_px, inputs);
    return Status::Ok();
  };
  r.evaluate = [](const Inputs& inputs) {
    return CircleCandidates(inputs, [](const CirclePose&, const Inputs&) -> Eigen::VectorXd {
      return Eigen::VectorXd(0);
    });
  };
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
    const Status status = SelectCircle(observations, false, evidence);
    if (!status.ok()) return status;
    evidence->circles.front().center.reset();
    if (observations.frame.x_axis && observations.frame.y_axis) {
      KeepAxisLine(observations, observations.frame.x_axis, PencilDirection::kX, evidence);
      KeepAxisLine(observations, observations.frame.y_axis, PencilDirection::kY, evidence);
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
  r.evaluate = EvaluateCircleFrame;
  return r;
}

using PencilPair = std::array<PencilObservation, 2>;

bool HasRole(const PencilObservation& pencil) { return pencil.direction != PencilDirection::kFree; }

// The first two pencils whose directions are more than three standard deviations apart. Those of
// two different axes are tried first, then those with one.
Status FirstPair(std::vector<PencilObservation> pencils, PencilPair* pair) {
  std::stable_sort(pencils.begin(), pencils.end(),
                   [](const PencilObservation& a, const PencilObservation& b) {
                     return HasRole(a) > HasRole(b);
                   });
  for (std::size_t i = 0; i < pencils.size(); ++i) {
    for (std::size_t j = i + 1; j < pencils.size(); ++j) {
      const VanishingPointFit &a = *pencils[i].fit, &b = *pencils[j].fit;
      const bool same_role = HasRole(pencils[i]) && pencils[i].direction == pencils[j].direction;
      const double sine2 = a.direction.cross(b.direction).squaredNorm();
      constexpr double kGate = 9.0, kRounding = 1e-18;
      if (same_role || !(sine2 > kGate * (a.covariance + b.covariance).trace()) ||
          !(sine2 > kRounding))
        continue;
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
  if (FirstPair(of_world, pair).ok()) return Status::Ok();
  const Status status = FirstPair(fitted, pair);
  if (!status.ok()) return status;
  *frame = FrameObservation();
  frame->plane = (*pair)[0].plane = (*pair)[1].plane = "pencils";
  (*pair)[0].direction = PencilDirection::kX;
  (*pair)[1].direction = PencilDirection::kFree;
  return Status::Ok();
}

Recipe LinePairsRecipe() {
  Recipe r;
  r.name = "line_pairs";
  r.needs = "two pencils of parallel lines, two or more lines each";
  r.select = [](const Observations& observations, Observations* evidence) {
    PencilPair pair;
    const Status status = SelectPencils(observations, &pair, &evidence->frame);
    if (!status.ok()) return status;
    evidence->camera = observations.camera;
    evidence->pencils = {pair[0], pair[1]};
    evidence->known_lengths = observations.known_lengths;
    return Status::Ok();
  };
  r.gather = [](const Observations& evidence, double sigma_px, Inputs* inputs) {
    GatherFrame(evidence, sigma_px, inputs);
    for (std::size_t i = 0; i < 2; ++i) {
      const PencilObservation& pencil = evidence.pencils[i];
      inputs->directions[i] = Measured(pencil.fit->direction, pencil.fit->covariance);
      inputs->roles[i] = pencil.direction;
    }
    if (evidence.frame.x_axis)
      inputs->x_line = AxisLine(evidence, *evidence.frame.x_axis, sigma_px);
    if (evidence.frame.y_axis)
      inputs->y_line = AxisLine(evidence, *evidence.frame.y_axis, sigma_px);
    if (inputs->origin.present()) return Status::Ok();
    // The origin: where the axes cross, or by convention where the first lines of the pencils do.
    const auto line = [&](const Measured& axis, std::size_t i) -> Eigen::Vector3d {
      if (axis.present()) return axis.value;
      for (const LineObservation& l : evidence.pencils[i].lines) {
        if (l.fit) return l.fit->line;
      }
      return Eigen::Vector3d::Zero();
    };
    Eigen::Vector3d crossing = line(inputs->x_line, 0).cross(line(inputs->y_line, 1));
    if (!(std::abs(crossing.z()) > 1e-9 * crossing.norm())) crossing = Eigen::Vector3d::UnitZ();
    inputs->origin.value = crossing / crossing.z();
    inputs->origin.columns = Eigen::MatrixXd::Zero(3, 0);
    return Status::Ok();
  };
  r.evaluate = EvaluateLinePairs;
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
       {SingleCircleRecipe(), CircleCenterRecipe(), CircleFrameRecipe(), LinePairsRecipe()}) {
    registry->Add(std::make_shared<ClosedFormSolver>(recipe, options));
  }
}

}  // namespace circline
