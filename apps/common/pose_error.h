// How far a pose is from the truth, up to what the evidence cannot tell.
#ifndef CIRCLINE_APPS_COMMON_POSE_ERROR_H_
#define CIRCLINE_APPS_COMMON_POSE_ERROR_H_

#include <Eigen/Core>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "apps/common/scene.h"
#include "circline/estimators/pose.h"

namespace circline::apps {

// The rotations S of the world for which R S is as good an answer as R: 1 for kNone, 4 for kD2, 8
// for kD4. For kAxis, whose group is continuous, the 4 of kD2 (see RotationErrorDeg).
std::vector<Eigen::Matrix3d> SymmetryGroup(Symmetry symmetry);

// Smallest angle between `estimate` and any equivalent of `truth`, degrees. For kAxis: the angle
// between the normals up to sign, which is that minimum over all rotations about the axis.
double RotationErrorDeg(const Eigen::Matrix3d& truth, const Eigen::Matrix3d& estimate,
                        Symmetry symmetry);

// Angle between two directions, degrees; without sense: up to sign.
double AngleDeg(const Eigen::Vector3d& a, const Eigen::Vector3d& b);
double AngleWithoutSenseDeg(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

// Errors of one hypothesis; what cannot be compared is absent.
struct PoseErrors {
  std::optional<double> rotation_deg;     // Not where a rotation is free.
  std::optional<double> normal_deg;       // Of the plane's normal.
  std::optional<double> translation_deg;  // Of its direction; only where the origin is observed.
  std::vector<std::pair<std::string, double>> directions_deg;  // By the truth's pencil id.

  // The one number to rank by: rotation, else normal, else the worst direction.
  std::optional<double> Headline() const;
};

// Standard deviation of the plane's normal, the larger of its two components, degrees: known where
// the only free rotation is the one about the normal. Absent where more is free.
std::optional<double> SigmaNormalDeg(const PoseHypothesis& hypothesis);

PoseErrors ComparePose(const PoseHypothesis& hypothesis, const SceneImage& image);

}  // namespace circline::apps

#endif  // CIRCLINE_APPS_COMMON_POSE_ERROR_H_
