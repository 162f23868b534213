// Where a refinement starts: every unknown at a seed's plane, from the points themselves. (A free
// conic of a short arc says nothing of its circle; its points in the plane do.)
#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <vector>

#include "circline/estimators/basics.h"
#include "circline/estimators/metrology.h"
#include "circline/estimators/statistics.h"
#include "circline/refine/block_chain.h"
#include "circline/refine/joint/joint_problem.h"
#include "circline/refine/plane_circle.h"

namespace circline {
namespace {

// A direction that was fitted through the camera as given, seen through one with another focal
// length (distortion left out).
Eigen::Vector3d Refocused(const Eigen::Vector3d& ray, double log_focal) {
  const double shrink = std::exp(-log_focal);
  return {shrink * ray.x(), shrink * ray.y(), ray.z()};
}

}  // namespace

bool JointProblem::Ray(const State& state, const Eigen::Vector2d& pixel,
                       Eigen::Vector3d* ray) const {
  const Camera& given = observations_.camera;
  CalibratedPoint p;
  if (!PixelToCalibrated(given, pixel, &p)) return false;
  if (camera_is_estimated_)
    p = SeenThrough(ShiftedCamera(given, At(kCamera, state)), given, pixel, p);
  *ray = p.Homogeneous();
  return true;
}

// A circle by its points in the state's plane: its centre, its radius where that is not known.
// `circle`: (cx, cy, r) as the points have it. False where it cannot lie there in front of the
// camera.
bool JointProblem::PlaceCircle(const CircleBlocks& c, State* state, Eigen::Vector3d* circle) const {
  const CameraPose pose = PoseAt(*state);
  FeatureCost& contour = *term(c.term).weighed;
  if (camera_is_estimated_) contour.SeeThrough(At(kCamera, *state));
  if (!FitPlaneCircle(contour.points()->seen(), pose, circle)) return false;
  const Eigen::Vector3d center(circle->x(), circle->y(), 0.0);
  if (!((pose.rotation * center + pose.translation).z() > 0.0)) return false;
  if (!block(c.center).is_constant)
    std::copy(circle->data(), circle->data() + 2, At(c.center, state));
  if (!(ObservationOf(c).radius > 0.0)) *At(c.radius, state) = circle->z();
  return true;
}

// Circles that cannot be placed are made inactive.
JointProblem::Placed JointProblem::PlaceCircles(State* state) const {
  Placed placed;
  for (const CircleBlocks& c : circles_) {
    std::uint8_t& is_active = state->active[static_cast<std::size_t>(c.feature)];
    Eigen::Vector3d circle;
    if (is_active == 0) continue;
    if (!PlaceCircle(c, state, &circle)) {
      is_active = 0;
      continue;
    }
    ++placed.num_circles;
    const bool is_at_origin =
        center_at_origin_ >= 0 &&
        c.center == circles_[static_cast<std::size_t>(center_at_origin_)].center;
    if (is_at_origin && !placed.origin) placed.origin = circle.head<2>();
    const double known = ObservationOf(c).radius;
    if (known > 0.0) placed.scales.push_back(known / circle.z());
  }
  return placed;
}

// Where the origin is seen: at a pixel, or where two drawn axes cross.
bool JointProblem::OriginRay(const State& state, Eigen::Vector3d* ray) const {
  const FrameObservation& frame = observations_.frame;
  if (frame.origin && Ray(state, *frame.origin, ray)) return true;
  if (!frame.x_axis || !frame.y_axis) return false;
  std::array<Eigen::Vector3d, 4> ends;
  for (std::size_t k = 0; k < 4; ++k) {
    if (!Ray(state, (k < 2 ? *frame.x_axis : *frame.y_axis)[k % 2], &ends[k])) return false;
  }
  *ray = ends[0].cross(ends[1]).cross(ends[2].cross(ends[3]));
  if (ray->z() < 0.0) *ray = -*ray;
  return true;
}

// Moves the world origin to where the evidence has it. False where that lies beyond the horizon.
bool JointProblem::PlaceOrigin(const Placed& placed, State* state) const {
  Eigen::Vector2d xy = placed.origin.value_or(Eigen::Vector2d::Zero());
  Eigen::Vector3d ray;
  if (center_at_origin_ < 0 && OriginRay(*state, &ray) && !PointOnPlane(PoseAt(*state), ray, &xy))
    return false;
  Eigen::Map<Eigen::Vector3d> t(At(kTranslation, state));
  t += PoseAt(*state).rotation.leftCols<2>() * xy;
  std::set<int> centers;
  for (const CircleBlocks& c : circles_) centers.insert(c.center);
  for (const int center : centers) {
    if (!block(center).is_constant) Eigen::Map<Eigen::Vector2d>(At(center, state)) -= xy;
  }
  return t.z() > 0.0 || !observations_.frame.origin;
}

// The ends of known lengths, then the unit of all: metric, or such that t is a unit vector.
void JointProblem::PlaceScale(Placed placed, State* state) const {
  const CameraPose pose = PoseAt(*state);
  for (const LengthBlocks& l : lengths_) {
    Eigen::Vector3d ray;
    bool is_seen = true;
    std::array<Eigen::Vector2d, 2> ends;
    const KnownLength& known =
        observations_.known_lengths[static_cast<std::size_t>(feature(l.feature).observation)];
    for (std::size_t k = 0; k < 2; ++k)
      is_seen = Ray(*state, known.points[k], &ray) && PointOnPlane(pose, ray, &ends[k]) && is_seen;
    const double length = is_seen ? (ends[0] - ends[1]).norm() : 0.0;
    if (!(length > 0.0)) {
      state->active[static_cast<std::size_t>(l.feature)] = 0;
      continue;
    }
    Eigen::Map<Eigen::Vector2d>(At(l.a, state)) = ends[0];
    Eigen::Map<Eigen::Vector2d>(At(l.b, state)) = ends[1];
    if (state->Has(l.feature)) placed.scales.push_back(known.value / length);
  }
  Eigen::Map<Eigen::Vector3d> t(At(kTranslation, state));
  const double scale = placed.scales.empty() ? 1.0 / t.norm() : Median(std::move(placed.scales));
  t *= scale;
  std::set<int> scaled;
  for (const CircleBlocks& c : circles_) {
    scaled.insert(c.center);
    if (!(ObservationOf(c).radius > 0.0)) scaled.insert(c.radius);
  }
  for (const LengthBlocks& l : lengths_) scaled.insert({l.a, l.b});
  for (const int index : scaled) {
    if (!block(index).is_constant)
      Eigen::Map<Eigen::VectorXd>(At(index, state), block(index).size) *= scale;
  }
}

bool JointProblem::PlaceLine(const LineBlocks& l, State* state) const {
  const Term& term = this->term(l.term);
  const double* parameters[kMostBlocks];
  Parameters(term, state->x.data(), parameters);
  return static_cast<const DirectionLineCost&>(*term.cost).Start(parameters, At(l.line, state));
}

bool JointProblem::Admit(std::size_t feature, State* state) const {
  const auto is_it = [feature](const auto& blocks) {
    return blocks.feature == static_cast<int>(feature);
  };
  state->active[feature] = 1;
  using Kind = Feature::Kind;
  const Kind kind = features_[feature].kind;
  if (kind == Kind::kPrior || kind == Kind::kAngle) return true;
  if (kind == Kind::kCenterMark) return state->Has(features_[feature].parent);
  const auto line = std::find_if(lines_.begin(), lines_.end(), is_it);
  if (line != lines_.end()) return PlaceLine(*line, state);
  const auto circle = std::find_if(circles_.begin(), circles_.end(), is_it);
  if (circle == circles_.end()) return false;
  const std::vector<double> before = state->x;
  Eigen::Vector3d unused;
  if (!PlaceCircle(*circle, state, &unused)) return false;
  // What it shares with circles that take part stays where these have it.
  for (int CircleBlocks::*const block : {&CircleBlocks::center, &CircleBlocks::radius}) {
    const bool is_shared = std::any_of(circles_.begin(), circles_.end(), [&](const auto& other) {
      return other.feature != circle->feature && other.*block == (*circle).*block &&
             state->Has(other.feature);
    });
    if (!is_shared) continue;
    const Block& shared = this->block((*circle).*block);
    std::copy_n(before.begin() + shared.offset, shared.size, state->x.begin() + shared.offset);
  }
  return true;
}

void JointProblem::PlaceLines(State* state) const {
  const Eigen::Matrix3d R = PoseAt(*state).rotation;
  for (std::size_t i = 0; i < observations_.pencils.size(); ++i) {
    const PencilObservation& pencil = observations_.pencils[i];
    if (directions_[i] < 0 || pencil.direction != PencilDirection::kFree) continue;
    // Where in the plane its lines would have it: the conditional mean, given that it lies there.
    const Eigen::Vector3d off = pencil.fit->covariance * R.col(2);
    const double variance = R.col(2).dot(off);
    Eigen::Vector3d d = pencil.fit->direction;
    if (variance > 0.0) d -= R.col(2).dot(d) / variance * off;
    d = R.transpose() * Refocused(d, LogFocalAt(*state));
    d.z() = 0.0;
    if (!(d.norm() > 0.0)) continue;
    d.normalize();
    std::copy(d.data(), d.data() + 3, At(directions_[i], state));
  }
  for (const LineBlocks& l : lines_) {
    std::uint8_t& is_active = state->active[static_cast<std::size_t>(l.feature)];
    if (is_active != 0 && !PlaceLine(l, state)) is_active = 0;
  }
  for (const PlaneLineBlocks& l : plane_lines_) {
    const double grow = std::exp(LogFocalAt(*state));
    const Eigen::Vector3d line(grow * l.fit.x(), grow * l.fit.y(), l.fit.z());
    const Eigen::Vector3d d = R.transpose() * R.col(2).cross(line);
    *At(l.angle, state) = std::atan2(d.y(), d.x());
  }
}

// Lines and circles do not tell the senses of the axes, and circles alone no axes: seeds take them
// by convention. What a prior says of them is more than that.
Eigen::Matrix3d JointProblem::SenseOfPriors(const CameraPose& seed, const State& state) const {
  const FrameObservation& frame = observations_.frame;
  if (pose_priors_.empty() || frame.x_axis || frame.y_axis) return seed.rotation;
  constexpr int kSpins = 16;
  constexpr double kTurn = 2.0 * kPi / kSpins;
  Eigen::Matrix3d best = seed.rotation;
  double least = std::numeric_limits<double>::infinity();
  for (const double face : {0.0, 0.5 * kSpins * kTurn}) {
    for (int spin = 0; spin < kSpins; spin += x_is_seen_ ? kSpins / 2 : 1) {
      const Eigen::Matrix3d R = seed.rotation *
                                Eigen::AngleAxisd(spin * kTurn, Eigen::Vector3d::UnitZ()) *
                                Eigen::AngleAxisd(face, Eigen::Vector3d::UnitX());
      const Eigen::Quaterniond q(R);
      const double* parameters[2] = {q.coeffs().data(), seed.translation.data()};
      double cost = 0.0, r[6];
      for (const PriorTerm& known : pose_priors_) {
        if (!IsActive(term(known.term), state)) continue;
        const ceres::CostFunction& prior = *term(known.term).cost;
        if (!prior.Evaluate(parameters, r, nullptr)) return seed.rotation;
        cost += Eigen::Map<const Eigen::VectorXd>(r, prior.num_residuals()).squaredNorm();
      }
      // Nothing but a clear word of the prior's turns the plane's normal round; where it says
      // nothing of a turn, rounding is not to decide.
      constexpr double kClear = 25.0, kRounding = 1e-9;
      if (!(cost + (face > 0.0 ? kClear : 0.0) < (1.0 - kRounding) * least)) continue;
      least = cost;
      best = R;
    }
  }
  return best;
}

// Whether a reading leaves all circles out, and lines of two directions tell the plane.
bool JointProblem::LinesSuffice(const Reading& reading) const {
  const bool has_circle = std::any_of(circles_.begin(), circles_.end(), [&](const auto& circle) {
    return reading[static_cast<std::size_t>(circle.feature)] != 0;
  });
  std::map<int, int> lines;  // By pencil.
  for (const LineBlocks& l : lines_) {
    if (reading[static_cast<std::size_t>(l.feature)] != 0) ++lines[feature(l.feature).observation];
  }
  const auto told = std::count_if(lines.begin(), lines.end(),
                                  [](const auto& pencil) { return pencil.second > 1; });
  return !has_circle && told > 1;
}

Status JointProblem::Start(const CameraPose& given, double log_focal, const Reading& reading,
                           State* state) const {
  state->x = values();
  state->active = reading;
  CameraPose seed = given;
  seed.rotation = SenseOfPriors(given, *state);
  if (camera_is_estimated_) {
    double* shifts = At(kCamera, state);
    shifts[0] = log_focal;
    // What is straight stays so.
    const Camera& camera = observations_.camera;
    if (camera.model == CameraModel::kOpenCV && camera_sigma_.IsLensOpen())
      shifts[4] = camera.distortion[0] * std::expm1(2.0 * log_focal);
  }
  Eigen::Map<Eigen::Quaterniond>(At(kRotation, state)) =
      Eigen::Quaterniond(seed.rotation).normalized();
  Eigen::Map<Eigen::Vector3d>(At(kTranslation, state)) = seed.translation;
  SeeThrough(*state);
  const Placed placed = PlaceCircles(state);
  if (!circles_.empty() && placed.num_circles == 0 && !LinesSuffice(reading)) {
    return Status::Refused(
        "no circle can lie in the plane: each crosses its horizon or lies beyond");
  }
  if (!PlaceOrigin(placed, state))
    return Status::Refused("the origin lies beyond the horizon of the plane");
  PlaceScale(placed, state);
  PlaceLines(state);
  state->cost = Cost(*state);
  return Status::Ok();
}

}  // namespace circline
