#include "circline/refine/joint_start.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "circline/estimators/random.h"

namespace circline {
namespace {

const PointSet& SetOf(const JointEvidence& e, int index) {
  return e.sets[static_cast<std::size_t>(index)];
}

// Circle of the plane like a fitted conic: seen in the plane this is an ellipse, and a circle where
// the plane's normal is one of the conic's.
bool PlaneCircle(const Eigen::Matrix3d& R, double facing, const Eigen::Matrix3d& conic,
                 double* cx_cy_radius) {
  const Eigen::Vector3d d(1.0, 1.0, facing);
  const Eigen::Matrix3d in_plane = d.asDiagonal() * R.transpose() * conic * R * d.asDiagonal();
  Ellipse ellipse;
  if (!ConicToEllipse(in_plane, &ellipse)) return false;
  cx_cy_radius[0] = ellipse.center.x();
  cx_cy_radius[1] = ellipse.center.y();
  cx_cy_radius[2] = std::sqrt(ellipse.a * ellipse.b);
  return true;
}

// An ellipse that the plane cannot explain (across or beyond the horizon) is an outlier of this
// seed; the seed is refused only where that leaves no circle.
bool InitializeCircles(const JointEvidence& e, JointState* state) {
  std::size_t left_out = 0;
  for (std::size_t i = 0; i < e.circles.size(); ++i) {
    const CircleTerm& t = e.circles[i];
    double circle[3];
    const ConicFit& fit = *e.observations.circles[static_cast<std::size_t>(t.observation)].fit;
    if (!PlaneCircle(state->rotation, state->facing, fit.conic, circle) ||
        !((state->rotation * Eigen::Vector3d(circle[0], circle[1], state->facing)).z() > 0.0)) {
      state->circle_left_out[i] = 1;
      left_out += SetOf(e, t.set).is_contaminated ? 0 : 1;  // Else it has another chance.
      continue;
    }
    double* center = state->At(t.center);
    std::copy(circle, circle + 2, center);
    (t.radius < 0 ? center[2] : state->At(t.radius)[0]) = circle[2] / t.factor;
  }
  return e.circles.empty() || left_out < e.circles.size();
}

// The angle of the line whose interpretation plane has (about) the normal m in the world frame.
void SetAngle(const LineTerm& t, const Eigen::Vector3d& m, JointState* state) {
  double* angle = state->At(t.angle);
  if (t.kind == LineKind::kFixedDirection) {
    angle[0] = std::atan2(m.dot(t.b), m.dot(t.a));
  } else if (t.kind == LineKind::kInPlane) {
    const double theta = state->At(t.shared)[0];
    angle[0] = std::atan2(m.z(), -std::sin(theta) * m.x() + std::cos(theta) * m.y());
  } else {
    angle[0] = std::atan2(-m.x(), m.y());  // A diameter.
  }
}

// The ends of the known lengths. One that does not lie in the plane in front of the camera is an
// outlier of this seed, with both its ends.
void InitializeLengths(const JointEvidence& e, JointState* state) {
  for (std::size_t i = 0; i < e.lengths.size(); ++i) {
    bool is_placed = true;
    for (const int block : {e.lengths[i].a, e.lengths[i].b}) {
      const auto point = std::find_if(e.points.begin(), e.points.end(),
                                      [block](const PointTerm& p) { return p.point == block; });
      is_placed = PlanePoint(state->rotation, state->facing, point->measured.x.Homogeneous(),
                             state->At(block)) &&
                  is_placed;
    }
    if (is_placed) continue;
    state->length_left_out[i] = 1;
    for (std::size_t k = 0; k < e.points.size(); ++k) {
      if (e.points[k].point == e.lengths[i].a || e.points[k].point == e.lengths[i].b)
        state->point_left_out[k] = 1;
    }
  }
}

// Plane distances per world unit, where no circle of known radius has set it already; 0 where
// nothing does.
void InitializeScale(const JointEvidence& e, JointState* state) {
  if (e.scale < 0) return;
  double* scale = state->At(e.scale);
  for (std::size_t i = 0; i < e.lengths.size() && !(scale[0] > 0.0); ++i) {
    if (state->length_left_out[i] != 0) continue;
    const double* a = state->At(e.lengths[i].a);
    const double* b = state->At(e.lengths[i].b);
    scale[0] = std::hypot(a[0] - b[0], a[1] - b[1]) / e.lengths[i].length;
  }
}

// --- Where a fit may have followed outliers ---

// The position of a line, tried at points of it one after the other: the one that explains most.
void ReconsiderLine(const JointEvidence& e, const LineTerm& t, JointState* state) {
  const PointSet& set = SetOf(e, t.set);
  // Something that every line of the pencil contains, in the world frame.
  Eigen::Vector3d common = t.a.cross(t.b);
  if (t.kind == LineKind::kInPlane) {
    const double theta = state->At(t.shared)[0];
    common = Eigen::Vector3d(std::cos(theta), std::sin(theta), 0.0);
  } else if (t.kind == LineKind::kDiameter) {
    common = Eigen::Vector3d(state->At(t.shared)[0], state->At(t.shared)[1], state->facing);
  }
  const bool is_axis = t.angle < 0;
  double* value =
      is_axis ? state->At(t.shared) + (t.kind == LineKind::kXAxis ? 1 : 0) : state->At(t.angle);
  const auto cost = [&] {
    Eigen::Matrix3d dm;
    const Eigen::Vector3d m = LineNormal(t, *state, &dm);
    return EvaluateLine(set, SetWeighing(), state->rotation, m, dm, nullptr);
  };
  double best = *value, least = cost();
  constexpr std::size_t kTrials = 24;
  const std::size_t stride = 1 + (set.points.size() - 1) / kTrials;
  for (std::size_t i = 0; i < set.points.size(); i += stride) {
    const Eigen::Vector3d ray = set.points[i].Homogeneous();
    if (is_axis) {
      double xy[2];
      if (!PlanePoint(state->rotation, state->facing, ray, xy)) continue;
      *value = xy[t.kind == LineKind::kXAxis ? 1 : 0];
    } else {
      SetAngle(t, common.cross(state->rotation.transpose() * ray), state);
    }
    const double trial = cost();
    if (trial < least) {
      least = trial;
      best = *value;
    }
  }
  *value = best;
}

// Circle through three points of the plane; false where they are in line.
bool CircleThrough(const std::array<Eigen::Vector2d, 3>& p, double* cx_cy_radius) {
  const Eigen::Vector2d a = p[1] - p[0], b = p[2] - p[0];
  const double cross = a.x() * b.y() - a.y() * b.x();
  if (!(std::abs(cross) > 1e-9 * a.norm() * b.norm())) return false;
  const Eigen::Vector2d from_first =
      Eigen::Vector2d(b.y() * a.squaredNorm() - a.y() * b.squaredNorm(),
                      a.x() * b.squaredNorm() - b.x() * a.squaredNorm()) /
      (2.0 * cross);
  cx_cy_radius[0] = p[0].x() + from_first.x();
  cx_cy_radius[1] = p[0].y() + from_first.y();
  cx_cy_radius[2] = from_first.norm();
  return true;
}

// A circle of its own in the plane, tried through triples of its points.
void ReconsiderCircle(const JointEvidence& e, std::size_t index, JointState* state) {
  const CircleTerm& t = e.circles[index];
  if (t.radius >= 0) return;  // Its centre or radius is not its own.
  const PointSet& set = SetOf(e, t.set);
  std::vector<Eigen::Vector2d> in_plane;
  for (const CalibratedPoint& p : set.points) {
    const Eigen::Vector2d x = set.scale * p.x + set.shift;
    double xy[2];
    if (PlanePoint(state->rotation, state->facing, x.homogeneous(), xy))
      in_plane.emplace_back(xy[0], xy[1]);
  }
  if (in_plane.size() < 5) return;
  double* circle = state->At(t.center);
  const auto cost = [&](const double* c) {
    return EvaluateCircle(set, SetWeighing(), state->rotation, state->facing, c[0], c[1], c[2],
                          nullptr);
  };
  double least =
      state->circle_left_out[index] != 0 ? std::numeric_limits<double>::infinity() : cost(circle);
  Random random(1);
  constexpr int kTrials = 60;
  for (int i = 0; i < kTrials; ++i) {
    std::array<Eigen::Vector2d, 3> sample;
    for (Eigen::Vector2d& p : sample)
      p = in_plane[static_cast<std::size_t>(random.UniformInt(static_cast<int>(in_plane.size())))];
    double trial[3];
    if (!CircleThrough(sample, trial)) continue;
    const double value = cost(trial);
    if (!(value < least)) continue;
    least = value;
    std::copy(trial, trial + 3, circle);
    state->circle_left_out[index] = 0;
  }
}

void Reconsider(const JointEvidence& e, JointState* state) {
  for (const LineTerm& t : e.lines) {
    if (SetOf(e, t.set).is_contaminated) ReconsiderLine(e, t, state);
  }
  for (std::size_t i = 0; i < e.circles.size(); ++i) {
    if (SetOf(e, e.circles[i].set).is_contaminated) ReconsiderCircle(e, i, state);
  }
}

}  // namespace

bool PlanePoint(const Eigen::Matrix3d& R, double facing, const Eigen::Vector3d& ray, double* xy) {
  const Eigen::Vector3d y = R.transpose() * ray;
  const double depth = facing * y.z();
  if (!(depth > 1e-9 * y.norm())) return false;
  xy[0] = y.x() / depth;
  xy[1] = y.y() / depth;
  return true;
}

Status InitializeState(const JointEvidence& e, const CameraPose& seed, JointState* state) {
  state->rotation = seed.rotation;
  state->facing = seed.rotation.col(2).dot(seed.translation) > 0.0 ? 1.0 : -1.0;
  state->values.assign(e.parameters.size(), {0.0, 0.0, 0.0});
  state->circle_left_out.assign(e.circles.size(), 0);
  state->line_left_out.assign(e.lines.size(), 0);
  state->point_left_out.assign(e.points.size(), 0);
  state->length_left_out.assign(e.lengths.size(), 0);
  const auto place = [&](const Eigen::Vector3d& ray, int block) {
    return PlanePoint(state->rotation, state->facing, ray, state->At(block));
  };
  if (e.origin >= 0 && !place(seed.translation, e.origin))
    return Status::Refused("the origin lies beyond the horizon of the plane");
  if (!InitializeCircles(e, state))
    return Status::Refused(
        "no circle can lie in the plane: each crosses its horizon or lies beyond");
  for (const auto& [id, theta] : e.thetas) {
    const PencilObservation& pencil =
        e.observations.pencils[static_cast<std::size_t>(FindPencil(e.observations, id))];
    const Eigen::Vector3d v = state->rotation.transpose() * pencil.fit->direction;
    state->At(theta)[0] = std::atan2(v.y(), v.x());
  }
  for (const LineTerm& term : e.lines) {
    if (term.angle >= 0) SetAngle(term, state->rotation.transpose() * term.line, state);
  }
  InitializeLengths(e, state);
  InitializeScale(e, state);
  Reconsider(e, state);
  return Status::Ok();
}

}  // namespace circline
