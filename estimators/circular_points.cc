#include "circline/estimators/circular_points.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <utility>

#include "circline/estimators/circle_pose.h"
#include "circline/estimators/line_pose.h"

namespace circline {
namespace {

// Scaled to entries of order 1, so that no product over- or underflows.
bool Scaled(const Eigen::Vector3d& v, Eigen::Vector3d* scaled) {
  const double largest = v.cwiseAbs().maxCoeff();
  if (!(largest > 0.0) || !std::isfinite(v.sum())) return false;
  *scaled = v / largest;
  return true;
}

bool ScaledPair(const CircularPoints& points, CircularPoints* scaled) {
  const double largest =
      std::fmax(points.real.cwiseAbs().maxCoeff(), points.imag.cwiseAbs().maxCoeff());
  if (!(largest > 0.0) || !std::isfinite(points.real.sum() + points.imag.sum())) return false;
  *scaled = {points.real / largest, points.imag / largest};
  return true;
}

constexpr double kMinSine = 1e-12;  // Below, two directions are one to rounding.

// The join of a pair that is scaled.
bool Join(const CircularPoints& scaled, Eigen::Vector3d* line) {
  const Eigen::Vector3d join = scaled.real.cross(scaled.imag);
  const double norm = join.norm();
  if (!(norm > kMinSine)) return false;
  *line = join / norm;
  return true;
}

// Where a line meets the vanishing line; false where it is that.
bool Meet(const Eigen::Vector3d& vanishing_line, const Eigen::Vector3d& line,
          Eigen::Vector3d* point) {
  Eigen::Vector3d scaled;
  if (!Scaled(line, &scaled)) return false;
  *point = vanishing_line.cross(scaled);
  return point->squaredNorm() > kMinSine * kMinSine;
}

// Two axes on one plane.
struct Axes {
  Eigen::Vector3d x, y;  // Where their images meet the vanishing line.
  // Of the angle from the one to the other: the real part of the square root of the cross ratio
  // {m, conj(m); x, y} = [m, y] [conj(m), x] / ([m, x] [conj(m), y]), of which the second half is
  // the conjugate of the first.
  double cosine;
};

bool FindAxes(const CircularPoints& points, const Eigen::Vector3d& x_line,
              const Eigen::Vector3d& y_line, Axes* axes) {
  CircularPoints m;
  Eigen::Vector3d normal;
  if (!ScaledPair(points, &m) || !Join(m, &normal) || !Meet(normal, x_line, &axes->x) ||
      !Meet(normal, y_line, &axes->y)) {
    return false;
  }
  const Eigen::Vector2d x(axes->x.dot(m.real), axes->x.dot(m.imag)),
      y(axes->y.dot(m.real), axes->y.dot(m.imag));
  axes->cosine = x.dot(y) / std::sqrt(x.squaredNorm() * y.squaredNorm());
  return std::isfinite(axes->cosine);
}

CircularPoints OfUnitNormal(const Eigen::Vector3d& n) {
  const Eigen::Vector3d real = n.unitOrthogonal();
  return {real, n.cross(real)};
}

}  // namespace

bool CircularPointsOfPlane(const Eigen::Vector3d& normal, CircularPoints* points) {
  Eigen::Vector3d n;
  if (!Scaled(normal, &n)) return false;
  *points = OfUnitNormal(n.normalized());
  return true;
}

int CircularPointsOfConic(const Eigen::Matrix3d& conic, std::array<CircularPoints, 2>* points) {
  std::array<CirclePose, 2> poses;
  const int count = CirclePoses(conic, &poses);
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    (*points)[i] = OfUnitNormal(poses[i].normal);
  }
  return count;
}

bool VanishingLine(const CircularPoints& points, Eigen::Vector3d* line) {
  CircularPoints m;
  return ScaledPair(points, &m) && Join(m, line);
}

bool HarmonicConjugate(const CircularPoints& points, const Eigen::Vector3d& v,
                       Eigen::Vector3d* conjugate) {
  CircularPoints m;
  Eigen::Vector3d w;
  if (!ScaledPair(points, &m) || !Scaled(v, &w)) return false;
  // v = p m + conj(p m) has the conjugate p m - conj(p m), which is i times this real vector; p is
  // alpha + i beta up to a factor, with v = alpha real + beta imag.
  const double alpha = w.dot(m.real), beta = w.dot(m.imag);
  constexpr double kMinNorm = 1e-24;  // Squared; below, v is the pole of the line to rounding.
  if (!(alpha * alpha + beta * beta > kMinNorm * m.real.squaredNorm())) return false;
  const Eigen::Vector3d result = (alpha * m.imag - beta * m.real).normalized() * v.stableNorm();
  if (!result.allFinite()) return false;
  *conjugate = result;
  return true;
}

bool RotationFromCircularPoints(const CircularPoints& points, const Eigen::Vector3d& x_line,
                                Eigen::Matrix3d* rotation) {
  Eigen::Vector3d normal, v_x, v_y;
  if (!VanishingLine(points, &normal) || !Meet(normal, x_line, &v_x) ||
      !HarmonicConjugate(points, v_x.normalized(), &v_y)) {
    return false;
  }
  *rotation << v_x.normalized(), v_y, normal;
  return true;
}

double HarmonicDeviation(const CircularPoints& points, const Eigen::Vector3d& x_line,
                         const Eigen::Vector3d& y_line) {
  Axes axes;
  if (FindAxes(points, x_line, y_line, &axes)) return axes.cosine;
  return std::numeric_limits<double>::infinity();
}

bool RotationFromFrame(const CircularPoints& points, const Eigen::Vector3d& x_line,
                       double x_variance, const Eigen::Vector3d& y_line, double y_variance,
                       FrameRotation* rotation) {
  Axes axes;
  if (!FindAxes(points, x_line, y_line, &axes)) return false;
  rotation->deviation = std::abs(axes.cosine);
  return RotationFromOrthogonalDirections(axes.x, x_variance, axes.y, y_variance,
                                          &rotation->rotation);
}

int RotationsFromCircleAndFrame(const Eigen::Matrix3d& conic, const Eigen::Vector3d& x_line,
                                const Eigen::Vector3d& y_line,
                                std::array<FrameRotation, 2>* rotations) {
  std::array<CircularPoints, 2> planes;
  const int candidates = CircularPointsOfConic(conic, &planes);
  std::size_t count = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(candidates); ++i) {
    if (RotationFromFrame(planes[i], x_line, 1.0, y_line, 1.0, &(*rotations)[count])) ++count;
  }
  if (count == 2 && (*rotations)[1].deviation < (*rotations)[0].deviation)
    std::swap((*rotations)[0], (*rotations)[1]);
  return static_cast<int>(count);
}

}  // namespace circline
