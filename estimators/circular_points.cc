#include "circline/estimators/circular_points.h"

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <utility>

#include "circline/estimators/circle_pose.h"

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

// Coordinates of a real point on the line, v = alpha real + beta imag, as alpha + i beta: up to the
// factor -i, the bracket [m, v] of the line's projective coordinate. That of conj(m) is its
// conjugate.
bool Bracket(const CircularPoints& points, const Eigen::Vector3d& v,
             std::complex<double>* bracket) {
  Eigen::Vector3d w;
  if (!Scaled(v, &w)) return false;
  *bracket = {w.dot(points.real), w.dot(points.imag)};
  constexpr double kMinNorm = 1e-24;  // Squared; below, v is the pole of the line to rounding.
  return std::norm(*bracket) > kMinNorm * points.real.squaredNorm();
}

// Both unit; false where they are parallel to rounding.
bool SymmetricRotation(const Eigen::Vector3d& normal, const Eigen::Vector3d& x,
                       const Eigen::Vector3d& y, Eigen::Matrix3d* rotation) {
  // Sum and difference of unit vectors are orthogonal whatever angle these enclose.
  const Eigen::Vector3d sum = x + y, difference = x - y;
  const double sum_norm = sum.norm(), difference_norm = difference.norm();
  constexpr double kMinSine = 1e-12;
  if (!(sum_norm > kMinSine) || !(difference_norm > kMinSine)) return false;
  constexpr double kSqrtHalf = 0.7071067811865476;
  const Eigen::Vector3d u = (kSqrtHalf / sum_norm) * sum,
                        v = (kSqrtHalf / difference_norm) * difference;
  rotation->col(0) = u + v;
  rotation->col(1) = u - v;
  rotation->col(2) = x.cross(y).dot(normal) < 0.0 ? Eigen::Vector3d(-normal) : normal;
  return true;
}

}  // namespace

bool CircularPointsOfPlane(const Eigen::Vector3d& normal, CircularPoints* points) {
  Eigen::Vector3d n;
  if (!Scaled(normal, &n)) return false;
  n.normalize();
  points->real = n.unitOrthogonal();
  points->imag = n.cross(points->real);
  return true;
}

int CircularPointsOfConic(const Eigen::Matrix3d& conic, std::array<CircularPoints, 2>* points) {
  std::array<CirclePose, 2> poses;
  const int count = CirclePoses(conic, &poses);
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    CircularPointsOfPlane(poses[i].normal, &(*points)[i]);
  }
  return count;
}

bool VanishingLine(const CircularPoints& points, Eigen::Vector3d* line) {
  CircularPoints m;
  if (!ScaledPair(points, &m)) return false;
  const Eigen::Vector3d join = m.real.cross(m.imag);
  const double norm = join.norm();
  constexpr double kMinSine = 1e-12;
  if (!(norm > kMinSine)) return false;
  *line = join / norm;
  return true;
}

bool CrossRatio(const CircularPoints& points, const Eigen::Vector3d& x, const Eigen::Vector3d& y,
                std::complex<double>* cross_ratio) {
  CircularPoints m;
  std::complex<double> mx, my;
  if (!ScaledPair(points, &m) || !Bracket(m, x, &mx) || !Bracket(m, y, &my)) return false;
  // [m, y] [conj(m), x] / ([m, x] [conj(m), y]): the second half is the conjugate of the first.
  const std::complex<double> half = my * std::conj(mx);
  *cross_ratio = half / std::conj(half);
  return true;
}

bool HarmonicConjugate(const CircularPoints& points, const Eigen::Vector3d& v,
                       Eigen::Vector3d* conjugate) {
  CircularPoints m;
  std::complex<double> bracket;
  if (!ScaledPair(points, &m) || !Bracket(m, v, &bracket)) return false;
  // v = p m + conj(p m) has the conjugate p m - conj(p m), which is i times this real vector.
  const Eigen::Vector3d turned = bracket.real() * m.imag - bracket.imag() * m.real;
  const Eigen::Vector3d result = turned.normalized() * v.stableNorm();
  if (!result.allFinite()) return false;
  *conjugate = result;
  return true;
}

bool RotationFromCircularPoints(const CircularPoints& points, const Eigen::Vector3d& x_line,
                                Eigen::Matrix3d* rotation) {
  Eigen::Vector3d normal, line, v_y;
  if (!VanishingLine(points, &normal) || !Scaled(x_line, &line)) return false;
  const Eigen::Vector3d v_x = normal.cross(line);
  constexpr double kMinSine = 1e-12;
  if (!(v_x.norm() > kMinSine) || !HarmonicConjugate(points, v_x.normalized(), &v_y)) return false;
  rotation->col(0) = v_x.normalized();
  rotation->col(1) = v_y;
  rotation->col(2) = normal;
  return true;
}

double HarmonicDeviation(const CircularPoints& points, const Eigen::Vector3d& x_line,
                         const Eigen::Vector3d& y_line) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Eigen::Vector3d normal, x, y;
  std::complex<double> cross_ratio;
  if (!VanishingLine(points, &normal) || !Scaled(x_line, &x) || !Scaled(y_line, &y) ||
      !CrossRatio(points, normal.cross(x), normal.cross(y), &cross_ratio)) {
    return kInfinity;
  }
  return 0.5 * std::abs(cross_ratio + 1.0);
}

int RotationsFromCircleAndFrame(const Eigen::Matrix3d& conic, const Eigen::Vector3d& x_line,
                                const Eigen::Vector3d& y_line,
                                std::array<FrameRotation, 2>* rotations) {
  Eigen::Vector3d x, y;
  if (!Scaled(x_line, &x) || !Scaled(y_line, &y)) return 0;
  std::array<CirclePose, 2> poses;
  const int candidates = CirclePoses(conic, &poses);
  std::size_t count = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(candidates); ++i) {
    const Eigen::Vector3d& n = poses[i].normal;
    Eigen::Vector3d v_x = n.cross(x), v_y = n.cross(y);
    const double norm_x = v_x.norm(), norm_y = v_y.norm();
    constexpr double kMinSine = 1e-12;
    if (!(norm_x > kMinSine) || !(norm_y > kMinSine)) continue;
    v_x /= norm_x;
    v_y /= norm_y;
    FrameRotation& r = (*rotations)[count];
    if (!SymmetricRotation(n, v_x, v_y, &r.rotation)) continue;
    // |cross ratio + 1| / 2 without the complex numbers.
    r.deviation = std::abs(v_x.dot(v_y));
    ++count;
  }
  if (count == 2 && (*rotations)[1].deviation < (*rotations)[0].deviation) {
    std::swap((*rotations)[0], (*rotations)[1]);
  }
  return static_cast<int>(count);
}

}  // namespace circline
