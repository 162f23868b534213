#include "circline/estimators/circle_pose.h"

#include <Eigen/Dense>
#include <cmath>
#include <limits>

namespace circline {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();

// The ellipse scaled to entries of order 1 and the signature (+, +, -); false for what
// NormalizeEllipse refuses. Its Frobenius norm is not needed here.
bool ScaledEllipse(const Eigen::Matrix3d& conic, Eigen::Matrix3d* scaled) {
  const double largest = conic.cwiseAbs().maxCoeff();
  // Summed, because maxCoeff may pass over a NaN.
  if (!(largest > 0.0) || !std::isfinite(conic.sum())) return false;
  const double scale = conic(0, 0) + conic(1, 1) < 0.0 ? -largest : largest;
  const Eigen::Matrix3d C = conic / scale;
  *scaled = 0.5 * (C + C.transpose());
  return scaled->topLeftCorner<2, 2>().determinant() > 0.0 && scaled->determinant() < 0.0;
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
Eigen::Vector3d SimpleEigenvector(Eigen::Matrix3d S, double l) {
  S.diagonal().array() -= l;
  const Eigen::Vector3d a = S.col(1).cross(S.col(2)), b = S.col(2).cross(S.col(0)),
                        c = S.col(0).cross(S.col(1));
  const double aa = std::abs(a.x()), bb = std::abs(b.y()), cc = std::abs(c.z());
  if (aa >= bb && aa >= cc) return a.normalized();
  return (bb >= cc ? b : c).normalized();
}

// Eigenvalues and outer eigenvectors. The eigenvalue that stands apart from the other two - by half
// of the spectrum or more - comes from the characteristic polynomial; the plane orthogonal to its
// vector leaves a 2x2 problem, whose gap of eigenvalues a hypotenuse gives to rounding however
// small it is. Iterative solvers take three times as long; direct ones that read all three vectors
// off the polynomial lose those of close eigenvalues (tilt 1e-4: 1e-4 rad).
bool SolveEigen3(const Eigen::Matrix3d& S, Eigen3* e) {
  const double mean = (S(0, 0) + S(1, 1) + S(2, 2)) / 3.0;
  Eigen::Matrix3d D = S;
  D.diagonal().array() -= mean;
  const double p = std::sqrt((D(0, 0) * D(0, 0) + D(1, 1) * D(1, 1) + D(2, 2) * D(2, 2) +
                              2.0 * (D(0, 1) * D(0, 1) + D(0, 2) * D(0, 2) + D(1, 2) * D(1, 2))) /
                             6.0);
  if (!(p > 0.0)) return false;
  const double r = 0.5 * D.determinant() / (p * p * p);
  const bool largest_apart = r >= 0.0;
  const double root = LargestCubicRoot(std::fmin(1.0, std::abs(r)));
  const Eigen::Vector3d v = SimpleEigenvector(S, largest_apart ? mean + p * root : mean - p * root);

  const Eigen::Vector3d w1 = v.unitOrthogonal(), w2 = v.cross(w1);
  // S x, column by column.
  const auto times = [&S](const Eigen::Vector3d& x) -> Eigen::Vector3d {
    return S.col(0) * x.x() + S.col(1) * x.y() + S.col(2) * x.z();
  };
  const Eigen::Vector3d Sw1 = times(w1), Sw2 = times(w2);
  const double apart = v.dot(times(v));
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
  Eigen::Matrix3d S;
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
