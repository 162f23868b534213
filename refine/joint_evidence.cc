#include "circline/refine/joint_evidence.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "circline/refine/crowds.h"

namespace circline {

void LineTerm::SetDirection(const Eigen::Vector3d& direction) {
  a = direction.unitOrthogonal();
  b = direction.cross(a);
}

JointEvidence::JointEvidence(const Observations& obs, const EstimationOptions& opts,
                             const NoiseScales& scales)
    : observations(obs), options(opts), camera(obs.camera) {
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
  SetScales(scales);
}

// Under "auto" the points of one feature share a smooth error (lens, blur, print, a surface not
// quite flat) of standard deviation b that no number n of them averages out: sigma^2 / (sigma^2 +
// n b^2) is what the set then counts. Its sigma stays that of a point, for loss and gate.
void JointEvidence::SetScales(const NoiseScales& scales) {
  for (PointSet& set : sets) {
    if (set.noise == PointSet::Noise::kStated) continue;
    const bool is_conic = set.noise == PointSet::Noise::kAutoConic;
    set.sigma_px = is_conic ? scales.conic_px : scales.line_px;
    const double bias = is_conic ? options.contour_bias_px : options.line_bias_px;
    const double n = static_cast<double>(set.points.size());
    const double variance = set.sigma_px * set.sigma_px;
    set.weight = variance / (variance + n * bias * bias);
  }
  for (PointTerm& point : points) {
    // A mark at a circle's centre is no better than the contour as a whole.
    if (point.like_set < 0) continue;
    const PointSet& set = sets[static_cast<std::size_t>(point.like_set)];
    point.measured.sigma_px = set.sigma_px / std::sqrt(set.weight);
  }
}

int JointEvidence::AddParameter(int size, bool is_private) {
  parameters.push_back({size, is_private});
  return static_cast<int>(parameters.size()) - 1;
}

// Index of a new point set, or -1 where no point is usable. `sigma_px` 0: automatic.
int JointEvidence::AddSet(const std::vector<Eigen::Vector2d>& pixels,
                          const std::vector<std::uint8_t>& mask, double sigma_px, bool is_conic) {
  PointSet set;
  const LossOptions& loss = is_conic ? options.conic_loss : options.line_loss;
  set.loss = loss.type;
  set.distance = options.conic_distance;
  set.sigma_px = sigma_px > 0.0 ? sigma_px : loss.scale_px;
  if (!(set.sigma_px > 0.0))
    set.noise = is_conic ? PointSet::Noise::kAutoConic : PointSet::Noise::kAutoLine;

  std::vector<std::uint8_t> trusted = mask, doubted;
  if (!mask.empty() && Redescends(set.loss)) {
    set.is_contaminated = IsContaminated(mask);
    for (const std::uint8_t m : mask) doubted.push_back(m == 0 ? 1 : 0);
    if (set.is_contaminated) {
      const std::vector<std::uint8_t> strung = NotCrowded(pixels, set.sigma_px);
      for (std::size_t i = 0; i < strung.size(); ++i) {
        trusted[i] &= strung[i];
        doubted[i] &= strung[i];
      }
    }
  }
  CalibrateInliers(camera, pixels, trusted, &set.points);
  set.num_trusted = set.points.size();
  if (!doubted.empty()) {
    std::vector<CalibratedPoint> more;
    CalibrateInliers(camera, pixels, doubted, &more);
    set.points.insert(set.points.end(), more.begin(), more.end());
  }
  if (set.points.empty()) return -1;
  if (is_conic) {
    set.Normalize();
  } else {
    set.Compress();
  }
  sets.push_back(std::move(set));
  return static_cast<int>(sets.size()) - 1;
}

// With `like_set` its sigma is settled by SetScales.
void JointEvidence::AddPoint(const Eigen::Vector2d& pixel, double sigma_px, int block, int like_set,
                             const std::string& name) {
  CalibratedPoint p;
  if (PixelToCalibrated(camera, pixel, &p)) {
    points.push_back({{p, sigma_px, options.line_loss.type}, block, like_set, name});
  } else {
    unused.push_back(name + ": not used, it lies where the camera model cannot undistort it");
  }
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
  AddPoint(*frame.origin, DrawnSigma(), origin, -1, "the origin of the frame");
}

// Whether the circle's centre is the origin: that is said of it or of one about the same centre. By
// convention the first circle's is, where nothing else is the origin.
bool JointEvidence::IsAtOrigin(const CircleObservation& circle) const {
  const std::string& named = observations.frame.origin_is_center;
  if (named.empty()) return origin < 0 && circles.empty();
  if (named == circle.id) return true;
  const int index = FindCircle(observations, named);
  return index >= 0 && !circle.concentric.empty() &&
         observations.circles[static_cast<std::size_t>(index)].concentric == circle.concentric;
}

// The block of a centre that other residuals share (the world origin, a concentric group), or -1.
int JointEvidence::CenterBlock(const CircleObservation& circle,
                               std::map<std::string, int>* concentric) {
  int center = -1;
  if (IsAtOrigin(circle)) {
    origin_observed = origin_observed || !observations.frame.origin_is_center.empty();
    if (origin < 0) origin = AddParameter(2, false);
    center = origin;
  }
  if (circle.concentric.empty()) return center;
  const auto group = concentric->find(circle.concentric);
  if (group != concentric->end()) return group->second;
  if (center < 0) center = AddParameter(2, false);
  return (*concentric)[circle.concentric] = center;
}

void JointEvidence::AddCircle(int index, std::map<std::string, int>* concentric) {
  const CircleObservation& circle = observations.circles[static_cast<std::size_t>(index)];
  if (!circle.fit || circle.plane != observations.frame.plane) return;
  const int set = AddSet(circle.points, circle.inliers, circle.sigma_px, true);
  if (set < 0) return;
  CircleTerm term{index, set, CenterBlock(circle, concentric), -1, 1.0};
  const bool has_center_evidence = circle.center || !circle.diameters.empty();
  if (term.center >= 0 || has_center_evidence || circle.radius > 0.0 ||
      !circle.radius_group.empty()) {
    // Two private blocks of one residual cannot both be eliminated first: the centre goes before
    // the radius.
    const bool center_is_private = term.center < 0 && !has_center_evidence;
    if (term.center < 0) term.center = AddParameter(2, center_is_private);
    term.factor = circle.radius > 0.0 ? circle.radius : 1.0;
    term.radius = RadiusBlock(circle, !center_is_private);
  } else {
    term.center = AddParameter(3, true);
  }
  circles.push_back(term);
  if (circle.center)
    AddPoint(*circle.center, 0.0, term.center, set, "the centre of circle '" + circle.id + "'");
  for (const Segment& diameter : circle.diameters) AddDiameter(circle, diameter, term.center);
}

int JointEvidence::RadiusBlock(const CircleObservation& circle, bool is_private) {
  if (circle.radius > 0.0) return ScaleBlock();
  if (circle.radius_group.empty()) return AddParameter(1, is_private);
  const auto group = radius_groups_.find(circle.radius_group);
  if (group != radius_groups_.end()) return group->second;
  return radius_groups_[circle.radius_group] = AddParameter(1, false);
}

int JointEvidence::ScaleBlock() {
  if (scale < 0) scale = AddParameter(1, false);
  return scale;
}

// The set and the fit of a line given by two points; false where these are not usable.
bool JointEvidence::AddSegment(const Segment& segment, double sigma_px, LineTerm* term) {
  const int set = AddSet({segment[0], segment[1]}, {}, sigma_px, false);
  LineFit fit;
  if (set < 0 || !FitLine(sets[static_cast<std::size_t>(set)].points, 1.0, &fit).ok()) return false;
  term->set = set;
  term->line = fit.line;
  return true;
}

void JointEvidence::AddDiameter(const CircleObservation& circle, const Segment& diameter,
                                int center) {
  LineTerm term{LineKind::kDiameter, -1, center, -1, Eigen::Vector3d::Zero()};
  if (!AddSegment(diameter, circle.sigma_px, &term)) return;
  term.name = "a diameter of circle '" + circle.id + "'";
  term.angle = AddParameter(1, true);
  lines.push_back(term);
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
    AddLine(pencil, theta, pencil.lines[j], AxisOfLine(index, static_cast<int>(j)),
            "pencil '" + pencil.id + "', line " + std::to_string(j));
  }
}

void JointEvidence::AddLine(const PencilObservation& pencil, int theta, const LineObservation& line,
                            int axis, const std::string& name) {
  if (!line.fit) return;
  const int set = AddSet(line.points, line.inliers, LineSigma(pencil, line), false);
  if (set < 0) return;
  LineTerm term{LineKind::kInPlane, set, theta, -1, line.fit->line, name};
  if (axis >= 0) {
    term.kind = axis == 0 ? LineKind::kXAxis : LineKind::kYAxis;
    term.shared = origin;
    x_is_fixed = true;
  } else {
    term.angle = AddParameter(1, true);
    if (theta < 0) {
      term.kind = LineKind::kFixedDirection;
      term.SetDirection(Eigen::Vector3d::Unit(static_cast<int>(pencil.direction)));
    }
  }
  lines.push_back(term);
}

// An axis drawn apart from the pencils is a line of its own: through the origin where that is
// observed, else just along X or Y.
void JointEvidence::AddAxis(const std::optional<Segment>& axis, bool is_x) {
  int p, l;
  if (!axis || FindAxisLine(observations, *axis, &p, &l)) return;
  LineTerm term{is_x ? LineKind::kXAxis : LineKind::kYAxis, -1, origin, -1, Eigen::Vector3d::Zero(),
                is_x ? "the X axis" : "the Y axis"};
  if (!AddSegment(*axis, DrawnSigma(), &term)) return;
  x_is_fixed = true;
  if (!origin_observed || origin < 0) {
    term.kind = LineKind::kFixedDirection;
    term.SetDirection(is_x ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY());
    term.shared = -1;
    term.angle = AddParameter(1, true);
  }
  lines.push_back(term);
}

// Between pencils of the plane, of which one at least is free; else there is nothing to act on.
void JointEvidence::AddAngle(const KnownAngle& known) {
  const std::string name =
      "the known angle between '" + known.pencils[0] + "' and '" + known.pencils[1] + "'";
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
      unused.push_back(name + ": not used, '" + known.pencils[k] +
                       "' is no pencil of the world's plane");
      return;
    }
  }
  if (term.theta[0] >= 0 || term.theta[1] >= 0) {
    angles.push_back(term);
  } else {
    unused.push_back(name + ": not used, both run along axes, which are orthogonal");
  }
}

void JointEvidence::AddLength(const KnownLength& known) {
  if (!IsInWorldPlane(known, observations)) {
    unused.push_back("a known length of the plane '" + known.plane +
                     "': not used, the world's is '" + observations.frame.plane + "'");
    return;
  }
  CalibratedPoint a, b;
  if (!PixelToCalibrated(camera, known.points[0], &a) ||
      !PixelToCalibrated(camera, known.points[1], &b)) {
    unused.push_back("a known length: not used, the camera model cannot undistort its ends");
    return;
  }
  const LengthTerm term{AddParameter(2, false), AddParameter(2, false), known.value};
  points.push_back(
      {{a, DrawnSigma(), options.line_loss.type}, term.a, -1, "an end of a known length"});
  points.push_back(
      {{b, DrawnSigma(), options.line_loss.type}, term.b, -1, "an end of a known length"});
  lengths.push_back(term);
  ScaleBlock();
}

}  // namespace circline
