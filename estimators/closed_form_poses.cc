#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "circline/estimators/circular_points.h"
#include "circline/estimators/closed_form_recipes.h"
#include "circline/estimators/directions.h"
#include "circline/estimators/line_pose.h"

namespace circline {
namespace {

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
    constexpr double kVertical = 0.05;  // Nearer to vertical than 3 degrees: then downwards.
    const bool horizontal = std::abs(R(0, 0)) > kVertical;
    if (horizontal ? R(0, 0) > 0.0 : R(1, 0) > 0.0) score += 1;
    if (score > best_score) {
      best_score = score;
      best = R;
    }
  }
  return best;
}

// Variance of the angle, in the plane with this normal, of a line's direction.
double InPlaneVariance(const Measured& line, const Eigen::Vector3d& normal) {
  const Eigen::Vector3d direction = normal.cross(Eigen::Vector3d(line.value));
  const double length2 = direction.squaredNorm();
  return (direction.transpose() * line.columns).squaredNorm() / (length2 * length2);
}

// Translation: where the origin's ray, followed backwards if need be (axes may cross behind the
// camera), meets the plane through the point `in_plane`, which the camera sees. Its length counts
// in units of `in_plane`, radii of the circle; a known radius or length makes it metric, else it is
// a direction.
Eigen::Vector3d Translation(const Eigen::Vector3d& n, const Eigen::Vector3d& in_plane,
                            const Eigen::Vector3d& origin_ray, const Inputs& inputs) {
  const double distance = n.dot(in_plane), along = n.dot(origin_ray);
  if (distance == 0.0 || along == 0.0) return origin_ray.normalized();
  const Eigen::Vector3d t = distance / along * origin_ray;
  if (!inputs.circles.empty() && inputs.radius > 0.0) return inputs.radius * t;
  if (inputs.length > 0.0) {
    const Eigen::Vector3d a = (*inputs.length_points)[0], b = (*inputs.length_points)[1];
    const double units = std::abs(distance) * (a / n.dot(a) - b / n.dot(b)).norm();
    if (units > 0.0) return inputs.length / units * t;
  }
  return t.normalized();
}

// Image of the origin as seen by a circle's hypothesis: the measured origin, the crossing of the
// axes, or the circle's centre.
Eigen::Vector3d OriginRay(const Inputs& inputs, const CirclePose& circle) {
  if (inputs.origin.present() && !inputs.origin_at_center) return inputs.origin.value;
  if (!inputs.origin_at_center && inputs.DrawnAxesCross()) {
    return Eigen::Vector3d(inputs.x_line.value).cross(Eigen::Vector3d(inputs.y_line.value));
  }
  return circle.center;
}

// The circles that a conic may be the image of, turned into the world's plane, against which they
// are tilted.
std::vector<CirclePose> TiltedPoses(const MeasuredCircle& circle) {
  std::array<CirclePose, 2> both;
  const int count = CirclePoses(VectorToConic(circle.conic.value), &both);
  std::vector<CirclePose> poses(both.begin(), both.begin() + count);
  const Eigen::Vector2d tilt = circle.tilt.value;
  if (tilt.isZero(0.0)) return poses;
  for (CirclePose& pose : poses) {
    pose.normal = (pose.normal + BasisAcross(pose.normal) * tilt).normalized();
  }
  return poses;
}

// One candidate per plane of the first circle; `contradict(&circle)` says how far other evidence
// speaks against it, and may turn it first into the plane that all of it says.
template <typename Contradict>
std::vector<Candidate> CircleCandidates(const Inputs& inputs, const Contradict& contradict) {
  std::vector<Candidate> candidates;
  std::vector<CirclePose> circles = TiltedPoses(inputs.circles[0]);
  for (CirclePose& circle : circles) {
    Candidate c;
    c.contradiction = contradict(&circle);
    if (!RotationOfPlane(circle.normal, circle.center, inputs, &c.pose.rotation)) continue;
    c.pose.translation =
        Translation(circle.normal, circle.center, OriginRay(inputs, circle), inputs);
    c.circle = circle;
    candidates.push_back(c);
  }
  return candidates;
}

Eigen::Vector2d CenterDeviation(const CirclePose& circle, const Eigen::VectorXd& measured) {
  return (circle.center / circle.center.z()).head<2>() - measured.head<2>() / measured[2];
}

// How far further circles contradict the first one: its own normal, as the mean is no independent
// witness, in coordinates of the plane of normal `n`, and where they are concentric its centre.
Eigen::VectorXd Contradiction(const std::vector<CirclePose>& circles, const Eigen::Vector3d& n,
                              bool concentric) {
  const Eigen::Matrix<double, 3, 2> across = BasisAcross(n);
  const Eigen::Index rows = concentric ? 4 : 2;
  Eigen::VectorXd contradiction(rows * static_cast<Eigen::Index>(circles.size() - 1));
  for (std::size_t i = 1; i < circles.size(); ++i) {
    const Eigen::Index row = rows * static_cast<Eigen::Index>(i - 1);
    contradiction.segment<2>(row) = across.transpose() * (circles[i].normal - circles[0].normal);
    if (concentric)
      contradiction.segment<2>(row + 2) = CenterDeviation(circles[i], circles[0].center);
  }
  return contradiction;
}

// The weighted mean of the circles' normals, each nearest to the first circle's.
std::vector<Candidate> CommonPlanes(const Inputs& inputs, bool concentric) {
  std::vector<std::vector<CirclePose>> more;
  for (std::size_t i = 1; i < inputs.circles.size(); ++i) {
    more.push_back(TiltedPoses(inputs.circles[i]));
    if (more.back().empty()) return {};
  }
  return CircleCandidates(inputs, [&](CirclePose* circle) {
    std::vector<CirclePose> nearest = {*circle};
    const auto is_farther = [&nearest](const CirclePose& x, const CirclePose& y) {
      return x.normal.dot(nearest[0].normal) < y.normal.dot(nearest[0].normal);
    };
    for (const std::vector<CirclePose>& poses : more)
      nearest.push_back(*std::max_element(poses.begin(), poses.end(), is_farther));
    circle->normal.setZero();
    for (std::size_t i = 0; i < nearest.size(); ++i)
      circle->normal += inputs.circles[i].normal_weight * nearest[i].normal;
    circle->normal.normalize();
    return Contradiction(nearest, circle->normal, concentric);
  });
}

// The frame whose Y axis is the X axis of this one.
Eigen::Matrix3d QuarterTurn(const Eigen::Matrix3d& R) {
  Eigen::Matrix3d turned;
  turned << -R.col(1), R.col(0), R.col(2);
  return turned;
}

// Proposition 1, where the roles say that the directions are orthogonal: the excess over 90 degrees
// is split by variance.
bool RotationOfAxes(const Inputs& inputs, Eigen::Matrix3d* rotation) {
  std::array<Eigen::Vector3d, 2> directions;
  if (!DirectionsOf(inputs, &directions)) return false;
  const auto& [a, b] = directions;
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

// The direction with a role comes first; where both have one, the better-measured does.
bool RotationOfPair(const Inputs& inputs, const Eigen::Vector3d& plane_ray,
                    Eigen::Matrix3d* rotation) {
  const auto [first, second] = inputs.roles;
  if (first != PencilDirection::kFree && second != PencilDirection::kFree) {
    Inputs anchored = inputs;
    const bool first_is_better =
        inputs.directions[0].columns.norm() <= inputs.directions[1].columns.norm();
    anchored.directions[first_is_better ? 0 : 1].columns.setZero();
    return RotationOfAxes(anchored, rotation);
  }
  std::array<Eigen::Vector3d, 2> directions;
  if (!DirectionsOf(inputs, &directions)) return false;
  const auto& [a, b] = directions;
  if (first == PencilDirection::kZ) {
    // The normal itself; the turn about it from the axes, else X is the other direction's
    // projection.
    if (inputs.x_line.present() || inputs.y_line.present()) {
      return RotationOfPlane(a, plane_ray, inputs, rotation);
    }
    const Eigen::Vector3d x = b - a * a.dot(b);
    return RotationFromDirections(x, a.cross(x), rotation);
  }
  if (!RotationFromDirections(a, b, rotation)) return false;
  if (first == PencilDirection::kFree)
    return RotationOfPlane(Eigen::Vector3d(rotation->col(2)), plane_ray, inputs, rotation);
  if (first == PencilDirection::kY) *rotation = QuarterTurn(*rotation);
  return true;
}

// A point of the plane that the camera sees: of a drawn axis, else the origin.
Eigen::Vector3d SeenPoint(const Inputs& inputs) {
  if (inputs.x_sense) return (*inputs.x_sense)[0];
  if (inputs.y_sense) return (*inputs.y_sense)[0];
  return inputs.origin.value;
}

// Completes a rotation from lines alone: senses, translation.
std::vector<Candidate> LinePose(const Eigen::Matrix3d& rotation, const Inputs& inputs) {
  Candidate c;
  const Eigen::Vector3d ray = SeenPoint(inputs);
  c.pose.rotation = Orient(rotation, ray, inputs);
  c.pose.translation = Translation(c.pose.rotation.col(2), ray, inputs.origin.value, inputs);
  if (!c.pose.rotation.allFinite() || !c.pose.translation.allFinite()) return {};
  return {c};
}

}  // namespace

bool RotationOfPlane(const Eigen::Vector3d& n, const Eigen::Vector3d& plane_ray,
                     const Inputs& inputs, Eigen::Matrix3d* rotation) {
  CircularPoints plane;
  bool valid = CircularPointsOfPlane(n, &plane);
  if (inputs.x_line.present() && inputs.y_line.present()) {
    FrameRotation frame;
    valid =
        valid && RotationFromFrame(plane, inputs.x_line.value, InPlaneVariance(inputs.x_line, n),
                                   inputs.y_line.value, InPlaneVariance(inputs.y_line, n), &frame);
    *rotation = frame.rotation;
  } else if (inputs.x_line.present()) {
    valid = valid && RotationFromCircularPoints(plane, inputs.x_line.value, rotation);
  } else if (inputs.y_line.present()) {
    valid = valid && RotationFromCircularPoints(plane, inputs.y_line.value, rotation);
    *rotation = QuarterTurn(*rotation);
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

std::vector<Candidate> SingleCirclePoses(const Inputs& inputs) {
  return CircleCandidates(inputs, [](const CirclePose*) { return Eigen::VectorXd(); });
}

std::vector<Candidate> CircleCenterPoses(const Inputs& inputs) {
  return CircleCandidates(inputs, [&inputs](const CirclePose* circle) {
    return CenterDeviation(*circle, inputs.center.value);
  });
}

std::vector<Candidate> CircleFramePoses(const Inputs& inputs) {
  return CircleCandidates(inputs, [&inputs](const CirclePose* circle) {
    const Eigen::Vector3d lx = inputs.x_line.value, ly = inputs.y_line.value;
    CircularPoints plane;
    CircularPointsOfPlane(circle->normal, &plane);
    // Lines along the axes cross anywhere; the axes themselves, at the origin.
    const bool at_crossing = inputs.origin_at_center && inputs.x_sense && inputs.y_sense;
    Eigen::VectorXd contradiction(at_crossing ? 3 : 1);
    contradiction[0] = HarmonicDeviation(plane, lx, ly);
    if (at_crossing) contradiction.tail<2>() = CenterDeviation(*circle, lx.cross(ly));
    return contradiction;
  });
}

std::vector<Candidate> ParallelCirclePoses(const Inputs& inputs) {
  return CommonPlanes(inputs, false);
}

std::vector<Candidate> ConcentricCirclePoses(const Inputs& inputs) {
  return CommonPlanes(inputs, true);
}

std::vector<Candidate> LinePairPoses(const Inputs& inputs) {
  Eigen::Matrix3d R;
  if (!RotationOfPair(inputs, SeenPoint(inputs), &R)) return {};
  return LinePose(R, inputs);
}

std::vector<Candidate> OrthogonalDirectionPoses(const Inputs& inputs) {
  Eigen::Matrix3d R;
  if (!RotationOfAxes(inputs, &R)) return {};
  return LinePose(R, inputs);
}

}  // namespace circline
