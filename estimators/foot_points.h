// The points of an ellipse nearest to measured ones, for several at a time. Allocates nothing.
#ifndef CIRCLINE_ESTIMATORS_FOOT_POINTS_H_
#define CIRCLINE_ESTIMATORS_FOOT_POINTS_H_

#include <Eigen/Core>

#include "circline/estimators/export.h"

namespace CIRCLINE_EXPORT circline {

// kLanes measured points and what a pixel is worth at each: x(u) = x + J u for pixels u about it.
template <int kLanes>
struct PixelFrames {
  using Lanes = Eigen::Array<double, kLanes, 1>;  // One number a point.
  Lanes x, y, j00, j01, j10, j11;                 // Calibrated x; J row by row.
};

// The points of an ellipse nearest to kLanes measured ones.
template <int kLanes>
struct FootPoints {
  using Lanes = Eigen::Array<double, kLanes, 1>;  // One number a point.
  Lanes distance;                                 // Signed, pixels, negative inside.
  Lanes x, y;                                     // On the ellipse.
  Lanes inverse_gradient;  // 1 / |gradient| of x^T C x there, by pixels; 0: of no meaning.
};

// f = x^T C x at the ellipse's centre, sign changed; positive for an ellipse with f < 0 inside.
inline double EllipseLevel(const Eigen::Matrix3d& C) {
  return -C.determinant() / C.topLeftCorner<2, 2>().determinant();
}

// In the pixel frame about a point the conic is f0 + g.u + u^T H u = 0. Its point nearest to u = 0
// is u = -mu/2 (I + mu H)^-1 g for the one mu in (-1/h_max, inf), h_max the larger eigenvalue of H,
// at which S(mu) = f(u) + level equals `level` (EllipseLevel). As for trust regions (More and
// Sorensen 1983), 1/sqrt(S) is concave and nearly linear, so Newton's steps on it approach mu from
// the left after the first, and two or three suffice; the very first is Sampson's approximation
// where the point is close. d distance / d ConicToVector(C) is, exactly, inverse_gradient times the
// monomials at the foot point, as the distance is stationary in the latter.
template <int kLanes>
FootPoints<kLanes> FindFootPoints(const PixelFrames<kLanes>& p, const Eigen::Matrix3d& C,
                                  double level) {
  using Lanes = Eigen::Array<double, kLanes, 1>;
  const double a = C(0, 0), b = C(0, 1), c = C(1, 1);
  const Lanes polar_x = a * p.x + b * p.y + C(0, 2), polar_y = b * p.x + c * p.y + C(1, 2);
  const Lanes f0 = p.x * polar_x + p.y * polar_y + (C(0, 2) * p.x + C(1, 2) * p.y + C(2, 2));
  const Lanes g0 = 2.0 * (p.j00 * polar_x + p.j10 * polar_y),
              g1 = 2.0 * (p.j01 * polar_x + p.j11 * polar_y);
  const Lanes h00 = a * p.j00 * p.j00 + 2.0 * b * p.j00 * p.j10 + c * p.j10 * p.j10,
              h11 = a * p.j01 * p.j01 + 2.0 * b * p.j01 * p.j11 + c * p.j11 * p.j11,
              h01 = a * p.j00 * p.j01 + b * (p.j00 * p.j11 + p.j01 * p.j10) + c * p.j10 * p.j11;
  const Lanes trace = h00 + h11, determinant = h00 * h11 - h01 * h01;
  const Lanes half = 0.5 * (h00 - h11);
  const Lanes mu_min = -1.0 / (0.5 * trace + (half * half + h01 * h01).sqrt());
  const Lanes k0 = h11 * g0 - h01 * g1, k1 = h00 * g1 - h01 * g0;  // adj(H) g.

  Lanes mu = Lanes::Zero(), w0 = g0, w1 = g1;  // w = (I + mu H)^-1 g = grad f(u).
  Lanes f = f0, inverse = Lanes::Ones();
  constexpr int kMaxSteps = 50;
  constexpr double kTolerance = 1e-12, kTiny = 1e-300;
  bool converged = false;
  for (int step = 0; step < kMaxSteps && !converged; ++step) {
    const Lanes quadratic = h11 * w0 * w0 - 2.0 * h01 * w0 * w1 + h00 * w1 * w1;
    const Lanes slope = (0.5 * (w0 * w0 + w1 * w1 + mu * quadratic) * inverse).max(kTiny);
    const Lanes ratio = (1.0 + f / level).max(0.0), root = ratio.sqrt();
    mu = (mu + 2.0 * ratio * f / ((1.0 + root) * slope)).max(0.5 * (mu + mu_min));
    inverse = 1.0 / (1.0 + mu * (trace + mu * determinant));
    w0 = (g0 + mu * k0) * inverse;
    w1 = (g1 + mu * k1) * inverse;
    f = f0 - 0.25 * mu * ((g0 + w0) * w0 + (g1 + w1) * w1);
    converged = (f.abs() <= kTolerance * level).all();
  }

  FootPoints<kLanes> foot;
  const Lanes norm = (w0 * w0 + w1 * w1).sqrt();
  foot.distance = 0.5 * mu * norm;
  foot.inverse_gradient = norm.inverse();
  if (!converged) {
    // The centre, or on the major axis near it: mu = mu_min, and there are two nearest points,
    // which u misses by an eigenvector of H. No derivative speaks for either.
    const auto between = (f < -kTolerance * level).eval();
    const Lanes r = foot.distance;
    foot.distance = between.select(-(r * r + f * mu_min).sqrt(), r);
    foot.inverse_gradient = between.select(0.0, foot.inverse_gradient);
  }
  foot.x = p.x - 0.5 * mu * (p.j00 * w0 + p.j01 * w1);
  foot.y = p.y - 0.5 * mu * (p.j10 * w0 + p.j11 * w1);
  return foot;
}

}  // namespace circline

#endif  // CIRCLINE_ESTIMATORS_FOOT_POINTS_H_
