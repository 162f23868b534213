#include "circline/estimators/line_pose.h"

#include <Eigen/Geometry>
#include <cmath>

namespace circline {
namespace {

// Unit vectors of both directions and their unit normal; false where they coincide.
bool Normal(const Eigen::Vector3d& x_direction, const Eigen::Vector3d& y_direction,
            Eigen::Vector3d* x, Eigen::Vector3d* y, Eigen::Vector3d* normal) {
  *x = x_direction.normalized();
  *y = y_direction.normalized();
  *normal = x->cross(*y);
  const double sine = normal->norm();
  constexpr double kMinSine = 1e-12;
  if (!(sine > kMinSine)) return false;
  *normal /= sine;
  return true;
}

}  // namespace

bool RotationFromDirections(const Eigen::Vector3d& x_direction, const Eigen::Vector3d& y_direction,
                            Eigen::Matrix3d* rotation) {
  Eigen::Vector3d x, y, normal;
  if (!Normal(x_direction, y_direction, &x, &y, &normal)) return false;
  rotation->col(0) = x;
  rotation->col(1) = normal.cross(x);
  rotation->col(2) = normal;
  return true;
}

bool RotationFromOrthogonalDirections(const Eigen::Vector3d& x_direction, double x_variance,
                                      const Eigen::Vector3d& y_direction, double y_variance,
                                      Eigen::Matrix3d* rotation) {
  Eigen::Vector3d x, y, normal;
  if (!Normal(x_direction, y_direction, &x, &y, &normal)) return false;
  // x and y enclose 90 degrees + excess; turn each towards the other by its share.
  const double sum = x_variance + y_variance;
  const double share = sum > 0.0 && std::isfinite(sum) ? x_variance / sum : 0.5;
  Eigen::Vector3d r1;
  if (share == 0.5) {
    r1 = (x + y.cross(normal)).normalized();  // Halfway, without trigonometry.
  } else {
    const double turn = share * std::atan2(-x.dot(y), x.cross(y).dot(normal));
    r1 = (std::cos(turn) * x + std::sin(turn) * normal.cross(x)).normalized();
  }
  rotation->col(0) = r1;
  rotation->col(1) = normal.cross(r1);
  rotation->col(2) = normal;
  return true;
}

std::array<Eigen::Matrix3d, 4> SignChoices(const Eigen::Matrix3d& rotation) {
  std::array<Eigen::Matrix3d, 4> choices;
  for (int i = 0; i < 4; ++i) {
    const double sx = (i & 1) != 0 ? -1.0 : 1.0, sy = (i & 2) != 0 ? -1.0 : 1.0;
    choices[static_cast<std::size_t>(i)] = rotation * Eigen::Vector3d(sx, sy, sx * sy).asDiagonal();
  }
  return choices;
}

bool MovesAlong(const Eigen::Vector3d& direction, const Eigen::Vector3d& normal,
                const Eigen::Vector3d& x0, const Eigen::Vector3d& x1) {
  // The plane meets the rays at depths inversely proportional to |n . x|.
  return direction.dot(x1 * std::abs(normal.dot(x0)) - x0 * std::abs(normal.dot(x1))) > 0.0;
}

}  // namespace circline
