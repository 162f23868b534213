#include "circline/refine/joint_evidence.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace circline {
JointEvidence::JointEvidence(const Observations& obs, const EstimationOptions& opts)
    : observations(obs), options(opts) {
  AddParameter(3, false);  // The rotation.
  AddFrame();
  std::map<std::string, int> concentric;
  for (std::size_t i = 0; i < observations.circles.size(); ++i)
    AddCircle(static_cast<int>(i), &concentric);
  for (std::size_t i = 0; i < observations.pencils.size(); ++i) AddPencil(static_cast<int>(i));
  AddAxis(observations.frame.x_axis, true);
  AddAxis(observations.frame.y_axis, false);
  for (const KnownAngle& known : observations.known_angles) AddAngle(known);
  for (const KnownLength& known : observations.known_lengths) AddLength(known);
}

int JointEvidence::AddParameter(int size, bool is_private) {
  parameters.push_back({size, is_private});
  return static_cast<int>(parameters.size()) - 1;
}

// Index of a new point set, or -1 where no point is usable.
int JointEvidence::AddSet(const std::vector<Eigen::Vector2d>& pixels,
                          const std::vector<std::uint8_t>& mask, double sigma_px, LossType loss) {
  PointSet set;
  CalibrateInliers(observations.camera, pixels, mask, &set.points);
  if (set.points.empty()) return -1;
  set.sigma_px = sigma_px;
  set.loss = loss;
  sets.push_back(std::move(set));
  return static_cast<int>(sets.size()) - 1;
}

void JointEvidence::AddPoint(const Eigen::Vector2d& pixel, double sigma_px, int block) {
  CalibratedPoint p;
  if (PixelToCalibrated(observations.camera, pixel, &p)) points.push_back({p, sigma_px, block});
}

bool JointEvidence::BothAxes() const {
  return observations.frame.x_axis && observations.frame.y_axis;
}

// Of points that belong to no pencil: drawn axes, the origin, ends of a known length.
double JointEvidence::DrawnSigma() const {
  constexpr double kDrawnSigmaPx = 0.5;
  return options.line_loss.scale_px > 0.0 ? options.line_loss.scale_px : kDrawnSigmaPx;
}

void JointEvidence::AddFrame() {
  const FrameObservation& frame = observations.frame;
  origin_observed = BothAxes() || frame.origin;
  if (BothAxes() || frame.origin) origin = AddParameter(2, false);
  if (!frame.origin) return;
  // An origin that is an end point of a drawn axis is no measurement of its own.
  const auto is_end = [&](const std::optional<Segment>& axis) {
    return axis && ((*axis)[0] == *frame.origin || (*axis)[1] == *frame.origin);
  };
  if (BothAxes() && (is_end(frame.x_axis) || is_end(frame.y_axis))) return;
  AddPoint(*frame.origin, DrawnSigma(), origin);
}

// The block of a centre that other residuals share (the world origin, a concentric group), or -1.
int JointEvidence::CenterBlock(const CircleObservation& circle,
                               std::map<std::string, int>* concentric) {
  const std::string& named_origin = observations.frame.origin_is_center;
  // By convention the first circle's centre is the origin where nothing else is.
  const bool is_origin =
      named_origin.empty() ? origin < 0 && circles.empty() : named_origin == circle.id;
  const auto group = concentric->find(circle.concentric);
  int center = !circle.concentric.empty() && group != concentric->end() ? group->second : -1;
  if (is_origin) {
    origin_observed = origin_observed || !named_origin.empty();
    if (origin < 0) origin = center >= 0 ? center : AddParameter(2, false);
    if (center < 0) center = origin;
  }
  if (circle.concentric.empty()) return center;
  if (center < 0) center = AddParameter(2, false);
  (*concentric)[circle.concentric] = center;
  return center;
}

void JointEvidence::AddCircle(int index, std::map<std::string, int>* concentric) {
  const CircleObservation& circle = observations.circles[static_cast<std::size_t>(index)];
  if (!circle.fit || circle.plane != observations.frame.plane) return;
  const double sigma = circle.sigma_px;
  const int set = AddSet(circle.points, circle.inliers, sigma, options.conic_loss.type);
  if (set < 0) return;
  CircleTerm term{index, set, CenterBlock(circle, concentric), -1, 1.0};
  const bool has_center_evidence = circle.center || !circle.diameters.empty();
  if (term.center >= 0 || has_center_evidence || circle.radius > 0.0) {
    // Two private blocks of one residual cannot both be eliminated first: the centre goes before
    // the radius.
    const bool center_is_private = term.center < 0 && !has_center_evidence;
    if (term.center < 0) term.center = AddParameter(2, center_is_private);
    term.factor = circle.radius > 0.0 ? circle.radius : 1.0;
    term.radius = circle.radius > 0.0 ? ScaleBlock() : AddParameter(1, !center_is_private);
  } else {
    term.center = AddParameter(3, true);
  }
  circles.push_back(term);
  if (circle.center) AddPoint(*circle.center, sigma, term.center);
  for (const Segment& diameter : circle.diameters) AddDiameter(diameter, sigma, term.center);
}

int JointEvidence::ScaleBlock() {
  if (scale < 0) scale = AddParameter(1, false);
  return scale;
}

void JointEvidence::AddDiameter(const Segment& diameter, double sigma_px, int center) {
  const int set = AddSet({diameter[0], diameter[1]}, {}, sigma_px, options.line_loss.type);
  LineFit fit;
  if (set < 0 || !FitLine(sets[static_cast<std::size_t>(set)].points, sigma_px, &fit).ok()) return;
  const int psi = AddParameter(1, true);
  lines.push_back({LineCost::Kind::kDiameter, set, center, psi, Eigen::Vector3d::Zero(), fit.line});
}

// The drawn axis that a pencil's line carries, where the origin is observed: 0 = x, 1 = y, -1 =
// none.
int JointEvidence::AxisOfLine(int pencil, int line) const {
  if (!origin_observed || origin < 0) return -1;
  const auto carries = [&](const std::optional<Segment>& axis) {
    int p, l;
    return axis && FindAxisLine(observations, *axis, &p, &l) && p == pencil && l == line;
  };
  return carries(observations.frame.x_axis) ? 0 : carries(observations.frame.y_axis) ? 1 : -1;
}

void JointEvidence::AddPencil(int index) {
  const PencilObservation& pencil = observations.pencils[static_cast<std::size_t>(index)];
  int theta = -1;
  if (pencil.direction == PencilDirection::kFree) {
    // Outside the plane, or a single line: it fixes its own direction, no more.
    if (pencil.plane != observations.frame.plane || !pencil.fit) return;
    theta = AddParameter(1, false);
    thetas[pencil.id] = theta;
  }
  x_is_fixed = x_is_fixed || pencil.direction == PencilDirection::kX ||
               pencil.direction == PencilDirection::kY;
  for (std::size_t j = 0; j < pencil.lines.size(); ++j) {
    AddLine(pencil, theta, pencil.lines[j], AxisOfLine(index, static_cast<int>(j)));
  }
}

void JointEvidence::AddLine(const PencilObservation& pencil, int theta, const LineObservation& line,
                            int axis) {
  if (!line.fit) return;
  const double sigma = pencil.sigma_px;
  const int set = AddSet(line.points, line.inliers, sigma, options.line_loss.type);
  if (set < 0) return;
  LineTerm term{LineCost::Kind::kInPlane, set, theta, -1, Eigen::Vector3d::Zero(), line.fit->line};
  if (axis >= 0) {
    term.kind = axis == 0 ? LineCost::Kind::kXAxis : LineCost::Kind::kYAxis;
    term.shared = origin;
    x_is_fixed = true;
  } else {
    term.angle = AddParameter(1, true);
    if (theta < 0) {
      term.kind = LineCost::Kind::kFixedDirection;
      term.direction = Eigen::Vector3d::Unit(static_cast<int>(pencil.direction));
    }
  }
  lines.push_back(term);
}

// An axis drawn apart from the pencils is a line of its own: through the origin where that is
// observed, else just along X or Y.
void JointEvidence::AddAxis(const std::optional<Segment>& axis, bool is_x) {
  int p, l;
  if (!axis || FindAxisLine(observations, *axis, &p, &l)) return;
  const double sigma = DrawnSigma();
  const int set = AddSet({(*axis)[0], (*axis)[1]}, {}, sigma, options.line_loss.type);
  LineFit fit;
  if (set < 0 || !FitLine(sets[static_cast<std::size_t>(set)].points, sigma, &fit).ok()) return;
  x_is_fixed = true;
  LineTerm term{is_x ? LineCost::Kind::kXAxis : LineCost::Kind::kYAxis,
                set,
                origin,
                -1,
                Eigen::Vector3d::Zero(),
                fit.line};
  if (!origin_observed || origin < 0) {
    term.kind = LineCost::Kind::kFixedDirection;
    term.direction = is_x ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
    term.shared = -1;
    term.angle = AddParameter(1, true);
  }
  lines.push_back(term);
}

// Between pencils of the plane; one that involves another direction has no parameter here to act
// on.
void JointEvidence::AddAngle(const KnownAngle& known) {
  constexpr double kExact = 1e-6;  // Radians: stands for an angle that is known exactly.
  AngleTerm term{known.value, std::max(known.sigma, kExact), {0.0, 0.0}, {-1, -1}};
  for (std::size_t k = 0; k < 2; ++k) {
    const auto theta = thetas.find(known.pencils[k]);
    const int index = FindPencil(observations, known.pencils[k]);
    if (index < 0) return;
    const PencilDirection direction =
        observations.pencils[static_cast<std::size_t>(index)].direction;
    if (theta != thetas.end()) {
      term.theta[k] = theta->second;
      term.fixed[k] = std::numeric_limits<double>::quiet_NaN();
    } else if (direction == PencilDirection::kY) {
      term.fixed[k] = 0.5 * 3.14159265358979323846;
    } else if (direction != PencilDirection::kX) {
      return;
    }
  }
  if (term.theta[0] >= 0 || term.theta[1] >= 0) angles.push_back(term);
}

void JointEvidence::AddLength(const KnownLength& known) {
  if (!known.plane.empty() && known.plane != observations.frame.plane) return;
  CalibratedPoint a, b;
  if (!PixelToCalibrated(observations.camera, known.points[0], &a) ||
      !PixelToCalibrated(observations.camera, known.points[1], &b)) {
    return;
  }
  const LengthTerm term{AddParameter(2, false), AddParameter(2, false), known.value};
  points.push_back({a, DrawnSigma(), term.a});
  points.push_back({b, DrawnSigma(), term.b});
  lengths.push_back(term);
  ScaleBlock();
}

}  // namespace circline
