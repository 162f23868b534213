#include "circline/estimators/circle_pose.h"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cmath>
#include <limits>

namespace circline {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

// The six entries of a symmetric matrix.
struct Symmetric3 {
  double xx, yy, zz, xy, xz, yz;

  Eigen::Vector3d operator*(const Eigen::Vector3d& v) const {
    return {xx * v.x() + xy * v.y() + xz * v.z(), xy * v.x() + yy * v.y() + yz * v.z(),
            xz * v.x() + yz * v.y() + zz * v.z()};
  }
};

// The ellipse scaled to entries of order 1 and the signature (+, +, -); false for what
// NormalizeEllipse refuses. Its Frobenius norm is not needed here.
bool ScaledEllipse(const Eigen::Matrix3d& conic, Symmetric3* scaled) {
  const double largest = conic.cwiseAbs().maxCoeff();
  // Summed, because maxCoeff may pass over a NaN.
  if (!(largest > 0.0) || !std::isfinite(conic.sum())) return false;
  const double scale = conic(0, 0) + conic(1, 1) < 0.0 ? -largest : largest;
  const Eigen::Matrix3d C = conic / scale;
  const Symmetric3 S = {C(0, 0),
                        C(1, 1),
                        C(2, 2),
                        0.5 * (C(0, 1) + C(1, 0)),
                        0.5 * (C(0, 2) + C(2, 0)),
                        0.5 * (C(1, 2) + C(2, 1))};
  const double quadratic = S.xx * S.yy - S.xy * S.xy;
  const double determinant = S.xx * (S.yy * S.zz - S.yz * S.yz) -
                             S.xy * (S.xy * S.zz - S.yz * S.xz) +
                             S.xz * (S.xy * S.yz - S.yy * S.xz);
  *scaled = S;
  return quadratic > 0.0 && determinant < 0.0;
}

struct Eigen3 {
  double l1, l2, l3;       // l1 >= l2 >= l3.
  double gap;              // l1 - l2, without cancellation where it is small.
  Eigen::Vector3d v1, v3;  // Unit.
};

// Root in [sqrt 3, 2] of x^3 - 3 x = 2 r for r in [0, 1], where the cubic is steep: x is good to
// rounding. A chord corrected by a parabola misses by 4e-3, and Newton squares that thrice.
double LargestCubicRoot(double r) {
  double x = 1.7320508075688772 + r * (0.2679491924311228 + 0.0607 * (1.0 - r));
  for (int i = 0; i < 3; ++i) x -= (x * (x * x - 3.0) - 2.0 * r) / (3.0 * (x * x - 1.0));
  return x;
}

// Eigenvector of a simple eigenvalue l, far from the other two: the longest column of the adjugate
// of S - l I, which is proportional to v v^T.
Eigen::Vector3d SimpleEigenvector(const Symmetric3& S, double l) {
  const double xx = S.xx - l, yy = S.yy - l, zz = S.zz - l;
  const double a = yy * zz - S.yz * S.yz, b = xx * zz - S.xz * S.xz, c = xx * yy - S.xy * S.xy;
  const double ab = S.xz * S.yz - S.xy * zz, ac = S.xy * S.yz - S.xz * yy,
               bc = S.xy * S.xz - S.yz * xx;
  const double aa = std::abs(a), bb = std::abs(b), cc = std::abs(c);
  Eigen::Vector3d v;
  if (aa >= bb && aa >= cc) {
    v = {a, ab, ac};
  } else if (bb >= cc) {
    v = {ab, b, bc};
  } else {
    v = {ac, bc, c};
  }
  return v.normalized();
}

// Eigenvalues and outer eigenvectors. The eigenvalue that stands apart from the other two - by half
// of the spectrum or more - comes from the characteristic polynomial; the plane orthogonal to its
// vector leaves a 2x2 problem, whose gap of eigenvalues a hypotenuse gives to rounding however
// small it is. Iterative solvers take three times as long; direct ones that read all three vectors
// off the polynomial lose those of close eigenvalues (tilt 1e-4: 1e-4 rad).
bool SolveEigen3(const Symmetric3& S, Eigen3* e) {
  const double mean = (S.xx + S.yy + S.zz) / 3.0;
  const double xx = S.xx - mean, yy = S.yy - mean, zz = S.zz - mean;
  const double p = std::sqrt(
      (xx * xx + yy * yy + zz * zz + 2.0 * (S.xy * S.xy + S.xz * S.xz + S.yz * S.yz)) / 6.0);
  if (!(p > 0.0)) return false;
  const double determinant = xx * (yy * zz - S.yz * S.yz) - S.xy * (S.xy * zz - S.yz * S.xz) +
                             S.xz * (S.xy * S.yz - yy * S.xz);
  const double r = 0.5 * determinant / (p * p * p);
  const bool largest_apart = r >= 0.0;
  const double root = LargestCubicRoot(std::fmin(1.0, std::abs(r)));
  const Eigen::Vector3d v = SimpleEigenvector(S, largest_apart ? mean + p * root : mean - p * root);

  const Eigen::Vector3d w1 = v.unitOrthogonal(), w2 = v.cross(w1);
  const Eigen::Vector3d Sw1 = S * w1, Sw2 = S * w2;
  const double apart = v.dot(S * v);
  const double a = w1.dot(Sw1), b = w1.dot(Sw2), c = w2.dot(Sw2);
  const double difference = 0.5 * (a - c), center = 0.5 * (a + c);
  const double radius = std::sqrt(difference * difference + b * b);
  // Vector of the larger eigenvalue center + radius, without cancellation.
  double cosine = 1.0, sine = 0.0;
  if (radius > 0.0) {
    const double x = difference >= 0.0 ? radius + difference : std::abs(b);
    const double y = difference >= 0.0 ? b : std::copysign(radius - difference, b);
    const double norm = std::sqrt(x * x + y * y);
    cosine = x / norm;
    sine = y / norm;
  }
  const Eigen::Vector3d upper = cosine * w1 + sine * w2, lower = cosine * w2 - sine * w1;
  if (largest_apart) {
    *e = {apart, center + radius, center - radius, apart - (center + radius), v, lower};
  } else {
    *e = {center + radius, center - radius, apart, 2.0 * radius, upper, v};
  }
  return true;
}

}  // namespace

int CirclePoses(const Eigen::Matrix3d& conic, std::array<CirclePose, 2>* poses) {
  Symmetric3 S;
  Eigen3 e;
  if (!ScaledEllipse(conic, &S) || !SolveEigen3(S, &e)) return 0;
  if (!(e.l2 > kEpsilon * e.l1) || !(e.l3 < -kEpsilon * e.l1)) return 0;  // Degenerate to rounding.

  // n = (+-s, 0, k) in the eigenframe annihilates the pencil member C - l2 I. On the plane n . X =
  // 1 the centre is the pole C^-1 n / (n^T C^-1 n) and the radius sqrt(-l1 l3) / l2, which gives
  // the centre in units of the radius without cancellation.
  const double inverse_spread = 1.0 / (e.l1 - e.l3);
  const double s = std::sqrt(std::fmax(0.0, e.gap) * inverse_spread);
  const double k = std::sqrt((e.l2 - e.l3) * inverse_spread);
  const double inverse_radius = 1.0 / std::sqrt(-e.l1 * e.l3);
  const Eigen::Vector3d s_v1 = s * e.v1, k_v3 = k * e.v3;
  const Eigen::Vector3d center1 = (e.l3 * inverse_radius) * s_v1,
                        center3 = (e.l1 * inverse_radius) * k_v3;
  const int count = e.gap > kEpsilon * e.l1 ? 2 : 1;
  for (int i = 0; i < count; ++i) {
    const double sign = i == 0 ? 1.0 : -1.0;
    const Eigen::Vector3d center = center3 + sign * center1;
    const double front = center.z() < 0.0 ? -1.0 : 1.0;
    CirclePose& pose = (*poses)[static_cast<std::size_t>(i)];
    pose.center = front * center;
    pose.normal = -front * (k_v3 + sign * s_v1);
  }
  return count;
}

Eigen::Matrix3d ProjectCircle(const CirclePose& pose) {
  // On the plane n . X = h a ray x meets X = h x / (n . x); |X - c|^2 = 1 times (n . x)^2 is
  // quadratic in x.
  const Eigen::Vector3d& n = pose.normal;
  const Eigen::Vector3d& c = pose.center;
  const double h = n.dot(c);
  const Eigen::Matrix3d C = h * h * Eigen::Matrix3d::Identity() -
                            h * (c * n.transpose() + n * c.transpose()) +
                            (c.squaredNorm() - 1.0) * n * n.transpose();
  return C / C.norm();
}

bool IsInView(const CirclePose& pose) {
  const Eigen::Vector3d& c = pose.center;
  const Eigen::Vector3d n = pose.normal.normalized();
  // Z varies along the circle by the sine of the angle between its normal and the optical axis.
  const double nearest = c.z() - std::hypot(n.x(), n.y());
  return nearest > 0.0 && std::abs(n.dot(c)) > kEpsilon * c.norm();
}

}  // namespace circline
