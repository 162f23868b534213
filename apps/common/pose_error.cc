#include "apps/common/pose_error.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "circline/estimators/basics.h"

namespace circline::apps {
namespace {

// Whether the scene says which point the origin is, so that two translations mean the same.
bool SceneGivesOrigin(const FrameObservation& frame) {
  return frame.origin.has_value() || !frame.origin_is_center.empty() ||
         (frame.x_axis.has_value() && frame.y_axis.has_value());
}

double NormalErrorDeg(const Eigen::Matrix3d& truth, const PoseHypothesis& hypothesis,
                      Symmetry symmetry) {
  const Eigen::Vector3d expected = truth.col(2);
  const Eigen::Vector3d actual = hypothesis.cam_from_world.rotation.col(2);
  // Where the rotation is free, nothing but convention decides the normal's sign.
  const bool has_sense = symmetry == Symmetry::kNone && !hypothesis.RotationIsFree();
  return has_sense ? AngleDeg(expected, actual) : AngleWithoutSenseDeg(expected, actual);
}

std::optional<double> DirectionErrorDeg(const TrueDirection& truth, bool any_pencil,
                                        const std::vector<PencilEstimate>& pencils) {
  std::optional<double> error;
  for (const PencilEstimate& pencil : pencils) {
    if (!any_pencil && pencil.id != truth.pencil) continue;
    const double angle = AngleWithoutSenseDeg(truth.direction, pencil.direction);
    error = error ? std::min(*error, angle) : angle;
  }
  return error;
}

}  // namespace

std::vector<Eigen::Matrix3d> SymmetryGroup(Symmetry symmetry) {
  std::vector<Eigen::Matrix3d> group(1, Eigen::Matrix3d::Identity());
  if (symmetry == Symmetry::kNone) return group;
  group.emplace_back(Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal());
  group.emplace_back(Eigen::Vector3d(-1.0, 1.0, -1.0).asDiagonal());
  group.emplace_back(Eigen::Vector3d(-1.0, -1.0, 1.0).asDiagonal());
  if (symmetry != Symmetry::kD4) return group;
  Eigen::Matrix3d quarter_turn;
  quarter_turn << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  for (std::size_t i = 0; i < 4; ++i) {
    const Eigen::Matrix3d turned = group[i] * quarter_turn;
    group.push_back(turned);
  }
  return group;
}

double AngleDeg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) / kDegree;
}

double AngleWithoutSenseDeg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::atan2(a.cross(b).norm(), std::abs(a.dot(b))) / kDegree;
}

double RotationErrorDeg(const Eigen::Matrix3d& truth, const Eigen::Matrix3d& estimate,
                        Symmetry symmetry) {
  if (symmetry == Symmetry::kAxis) return AngleWithoutSenseDeg(truth.col(2), estimate.col(2));
  double smallest = 360.0;
  for (const Eigen::Matrix3d& s : SymmetryGroup(symmetry)) {
    smallest = std::min(smallest, RotationAngle(truth * s, estimate) / kDegree);
  }
  return smallest;
}

std::optional<double> PoseErrors::Headline() const {
  if (rotation_deg) return rotation_deg;
  if (normal_deg) return normal_deg;
  std::optional<double> worst;
  for (const auto& [id, error] : directions_deg) worst = worst ? std::max(*worst, error) : error;
  return worst;
}

std::optional<double> SigmaNormalDeg(const PoseHypothesis& hypothesis) {
  const double sigma = hypothesis.SigmaNormal();
  if (!std::isfinite(sigma)) return std::nullopt;
  return sigma / kDegree;
}

PoseErrors ComparePose(const PoseHypothesis& hypothesis, const SceneImage& image) {
  PoseErrors errors;
  if (!image.truth) return errors;
  const Truth& truth = *image.truth;
  const CameraPose& pose = hypothesis.cam_from_world;
  if (truth.rotation) {
    errors.normal_deg = NormalErrorDeg(*truth.rotation, hypothesis, truth.symmetry);
    if (!hypothesis.RotationIsFree()) {
      errors.rotation_deg = RotationErrorDeg(*truth.rotation, pose.rotation, truth.symmetry);
    }
  }
  const bool same_origin = SceneGivesOrigin(image.observations.frame) ||
                           (truth.symmetry == Symmetry::kNone && !image.detect_everything);
  if (truth.translation && hypothesis.origin_observed && same_origin) {
    errors.translation_deg = AngleDeg(*truth.translation, pose.translation);
  }
  for (const TrueDirection& direction : truth.directions) {
    const std::optional<double> error =
        DirectionErrorDeg(direction, image.detect_everything, hypothesis.pencils);
    if (error) errors.directions_deg.emplace_back(direction.pencil, *error);
  }
  return errors;
}

}  // namespace circline::apps
